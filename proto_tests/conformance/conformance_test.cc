// The protocol and the robots' arithmetic on a microcontroller: the vectors of protocol/vectors,
// random streams against the naive decoder, and the same bits as on the host for steering and
// angles. The same test is linked once for each chip (target.h).
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client_fw/core/angle.h"
#include "client_fw/core/robot_net.h"
#include "client_fw/core/steering.h"
#include "proto_tests/conformance/client.h"
#include "protocol/testing/listen.h"
#include "protocol/testing/message_table.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"
#include "server/nets/system_file.h"
#include "server/petri/net.h"

namespace pheromone::conformance {
namespace {

using testing::Agree;
using testing::Bytes;
using testing::FieldsVector;
using testing::FrameVector;
using testing::Heard;
using testing::NaiveDecoder;
using testing::TimedByte;

constexpr uint16_t kGapMs = 20;

// Each test powers up its own processor.
class ChipTest : public ::testing::Test {
 protected:
  ConformanceClient chip_;
};

using ChipProtocol = ChipTest;
using ChipClientCore = ChipTest;

// Random inputs, the same on every machine.
class Dice {
 public:
  explicit Dice(uint64_t seed) : generator_(seed) {}

  size_t Below(size_t limit) { return static_cast<size_t>(generator_() % limit); }
  bool OneIn(size_t limit) { return Below(limit) == 0; }

  /// Any integer of a type; every other time one near 0 or the type's ends.
  template <typename Integer>
  Integer Any() {
    constexpr int64_t kEnds[] = {0, std::numeric_limits<Integer>::min(),
                                 std::numeric_limits<Integer>::max()};
    if (OneIn(2)) {
      const int64_t near = kEnds[Below(3)] + static_cast<int64_t>(Below(5)) - 2;
      return static_cast<Integer>(near);  // wraps around the ends
    }
    return static_cast<Integer>(generator_());
  }

  /// -bound to bound, over all magnitudes.
  int32_t Within(int32_t bound) {
    const size_t size = 2 * static_cast<size_t>(bound >> Below(24)) + 1;
    return static_cast<int32_t>(Below(size)) - static_cast<int32_t>(size / 2);
  }

  /// The bytes that mean something come much more often than the others.
  Bytes Some(size_t size) {
    constexpr uint8_t kLoaded[] = {0x10, 0x10, 0x10, 0x02, 0x03, 0x00};
    Bytes bytes(size);
    for (uint8_t& byte : bytes) {
      const size_t roll = Below(16);
      byte = roll < sizeof(kLoaded) ? kLoaded[roll] : static_cast<uint8_t>(Below(256));
    }
    return bytes;
  }

 private:
  std::mt19937_64 generator_;
};

std::vector<TimedByte> WithoutPauses(const Bytes& bytes) {
  std::vector<TimedByte> stream;
  testing::Append(bytes, 0, &stream);
  return stream;
}

TEST_F(ChipTest, TheImageRunsOnTheChipThatItIsMeantFor) {
  EXPECT_EQ(chip_.Identify(), TargetSizes());
}

TEST_F(ChipTest, ARequestThatIsNotUnderstoodIsRefusedAndTheNextOneAnswered) {
  const Bytes refused{kRefused};
  EXPECT_EQ(chip_.Ask({}), refused);
  EXPECT_EQ(chip_.Ask({'x'}), refused);
  EXPECT_EQ(chip_.Ask({kSteer, 0, 0}), refused);
  EXPECT_EQ(chip_.Ask(Bytes(kMaxRequest + 1, kCrc)), refused);
  EXPECT_THROW(chip_.EncodeFrame(1, 1, 0, {}, 141), std::runtime_error);
  EXPECT_EQ(chip_.Crc({'1', '2', '3', '4', '5', '6', '7', '8', '9'}), 0xBB3D);
}

TEST_F(ChipProtocol, ComputesTheCrcOfEveryVector) {
  const auto vectors = testing::LoadCrcs();
  ASSERT_GE(vectors.size(), 10u);
  for (const testing::CrcVector& vector : vectors) {
    EXPECT_EQ(chip_.Crc(vector.bytes), vector.crc) << ::testing::PrintToString(vector.bytes);
  }
}

TEST_F(ChipProtocol, EncodesEveryFrameOfTheVectorsByteForByte) {
  int encoded = 0;
  for (const FrameVector& vector : testing::LoadFrames()) {
    if (!vector.body) {
      continue;
    }
    const Bytes& body = *vector.body;
    const Bytes data(body.begin() + 2, body.end());
    const auto length = static_cast<uint8_t>(data.size());
    const auto size = static_cast<uint16_t>(vector.wire.size());
    EXPECT_EQ(chip_.EncodeFrame(body[0], body[1], length, data, size), vector.wire) << vector.name;
    EXPECT_EQ(chip_.EncodeFrame(body[0], body[1], length, data, size - 1), Bytes()) << vector.name;
    ++encoded;
  }
  EXPECT_GE(encoded, 50);
  EXPECT_EQ(chip_.EncodeFrame(1, 1, 65, {}, 140), Bytes()) << "a length over the limit";
}

TEST_F(ChipProtocol, GivesEveryFrameOfTheVectorsItsVerdict) {
  const std::map<std::string, uint32_t protocol::DecoderCounters::*> counters = {
      {"ok", &protocol::DecoderCounters::frames},
      {"unknown-opcode", &protocol::DecoderCounters::frames},
      {"bad-length", &protocol::DecoderCounters::frames},
      {"bad-value", &protocol::DecoderCounters::frames},
      {"refused", &protocol::DecoderCounters::refused},
      {"bad-crc", &protocol::DecoderCounters::crc_errors},
      {"bad-escape", &protocol::DecoderCounters::bad_escapes},
      {"oversize", &protocol::DecoderCounters::oversize},
      {"runt", &protocol::DecoderCounters::runts},
  };
  std::map<std::string, int> seen;
  for (const FrameVector& vector : testing::LoadFrames()) {
    SCOPED_TRACE(vector.name);
    const auto stream = WithoutPauses(vector.wire);
    const Heard heard = chip_.DecodeStream(stream, kGapMs);
    EXPECT_EQ(heard.bodies,
              vector.delivered() ? std::vector<Bytes>{*vector.body} : std::vector<Bytes>{});
    EXPECT_EQ(heard.counters.*counters.at(vector.verdict), 1u) << vector.verdict;
    EXPECT_TRUE(Agree(heard, NaiveDecoder(stream, kGapMs).Run()));
    ++seen[vector.verdict];
  }
  EXPECT_EQ(seen.size(), counters.size()) << "each verdict has a vector";
}

TEST_F(ChipProtocol, FindsTheFramesOfEveryStreamOfTheVectors) {
  const auto vectors = testing::LoadStreams();
  ASSERT_GE(vectors.size(), 10u);
  for (const testing::StreamVector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    const auto stream = WithoutPauses(vector.bytes);
    const Heard heard = chip_.DecodeStream(stream, kGapMs);
    EXPECT_EQ(heard.bodies, vector.delivered);
    EXPECT_TRUE(Agree(heard, NaiveDecoder(stream, kGapMs).Run()));
  }
}

// A COMMAND's arguments and a PING's payload are bytes to both sides, which fields.txt spells in
// other ways: they are compared with the frame.
void ExpectBytesAsInTheBody(const std::string& name, size_t from, const DecodedMessage& decoded,
                            const Bytes& body) {
  size_t at = from;
  for (const Field& field : decoded.fields) {
    if (field.name == name) {
      EXPECT_EQ(field.value, at < body.size() ? body[at] : 0) << name << ' ' << at - from;
      ++at;
    }
  }
  EXPECT_GE(at, body.size());
}

// The first of each list of a ROUND or of SCAN's answer, as many as are counted, separated by
// commas.
void ExpectLists(const FieldsVector& vector, const DecodedMessage& decoded) {
  std::map<std::string, std::vector<int32_t>> all;
  for (const Field& field : decoded.fields) {
    all[field.name].push_back(field.value);
  }
  const auto text = [&all](const std::string& name, int32_t count) {
    std::string joined;
    for (int32_t i = 0; i < count; ++i) {
      joined += (i == 0 ? "" : ",") + std::to_string(all.at(name).at(static_cast<size_t>(i)));
    }
    return joined.empty() ? "-" : joined;
  };
  const std::map<std::string, std::string> counts = {
      {"left", "answer_count"},   {"right", "answer_count"}, {"turns", "turn_count"},
      {"tag", "row_count"},       {"dx", "row_count"},       {"dy", "row_count"},
      {"generation", "row_count"}};
  for (const auto& [name, value] : vector.fields) {
    if (name == "id" && vector.message == "ROUND") {
      continue;
    }
    const auto list = counts.find(name);
    EXPECT_EQ(text(name, list == counts.end() ? 1 : all.at(list->second)[0]), value) << name;
  }
}

// Where the text of a body begins.
size_t TextFrom(const std::string& message) {
  return message == "SYMBOL" ? 8 : 16;
}

void ExpectFields(const FieldsVector& vector, const DecodedMessage& decoded, const Bytes& body) {
  if (vector.message == "ROUND" || vector.message == "SCAN_ANSWER") {
    ExpectLists(vector, decoded);
    return;
  }
  size_t compared = 0;
  for (const Field& field : decoded.fields) {
    if (field.name == "wide" || field.name == "answer" || field.name == "erased") {
      continue;  // in the message's name
    }
    if (field.name == "length") {
      EXPECT_EQ(field.value, static_cast<int>(body.size()) - 2);
    } else if (field.name == "text_count") {
      EXPECT_EQ(field.value, static_cast<int>(body.size() - TextFrom(vector.message)));
    } else if (field.name != "arguments" && field.name != "payload" && field.name != "text") {
      const auto found = vector.fields.find(field.name);
      ASSERT_NE(found, vector.fields.end()) << field.name;
      const auto expected = static_cast<int32_t>(static_cast<uint32_t>(std::stoll(found->second)));
      EXPECT_EQ(field.value, expected) << field.name;
      ++compared;
    }
  }
  if (vector.message == "COMMAND") {
    ExpectBytesAsInTheBody("arguments", 4, decoded, body);
  } else if (vector.message == "PING" || vector.message == "PING_ANSWER") {
    ExpectBytesAsInTheBody("payload", 2, decoded, body);
  } else if (vector.fields.count("text") > 0) {
    ExpectBytesAsInTheBody("text", TextFrom(vector.message), decoded, body);
    EXPECT_EQ(compared + 1, vector.fields.size()) << "fields that the chip does not know";
  } else {
    EXPECT_EQ(compared, vector.fields.size()) << "fields that the chip does not know";
  }
}

TEST_F(ChipProtocol, ReadsEveryMessageOfTheVectorsFieldByFieldAndWritesItAgain) {
  std::map<std::string, Bytes> bodies;
  for (const FrameVector& vector : testing::LoadFrames()) {
    bodies[vector.name] = vector.body.value_or(Bytes());
  }
  const auto vectors = testing::LoadFields();
  ASSERT_GE(vectors.size(), 50u);
  for (const FieldsVector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    const Bytes& body = bodies.at(vector.name);
    const std::vector<DecodedMessage> all = chip_.DecodeMessage(body);
    ASSERT_EQ(all.size(), 1u) << "messages that accept it";
    EXPECT_EQ(all[0].name, vector.message);
    EXPECT_EQ(all[0].encoded, body);
    ExpectFields(vector, all[0], body);
  }
}

TEST_F(ChipProtocol, ReadsNoMessageOfUnknownOpcodeBadLengthOrBadValue) {
  int tried = 0;
  for (const FrameVector& vector : testing::LoadFrames()) {
    if (vector.delivered() && vector.verdict != "ok") {
      EXPECT_TRUE(chip_.DecodeMessage(*vector.body).empty()) << vector.name;
      ++tried;
    }
  }
  EXPECT_GE(tried, 15);
}

TEST_F(ChipProtocol, KnowsTheTableOfMessages) {
  const Lengths lengths = chip_.GetLengths();
  const auto table = testing::MessageTable();
  for (unsigned opcode = 0; opcode < 256; ++opcode) {
    const protocol::LengthRule& rule = lengths.of_opcode[opcode];
    EXPECT_EQ(rule.known, !table[opcode].name.empty()) << opcode;
    if (rule.known) {
      EXPECT_EQ(rule.least, table[opcode].least) << opcode;
      EXPECT_EQ(rule.most, table[opcode].most) << opcode;
    }
    const int arguments = testing::CommandArguments(opcode);
    EXPECT_EQ(lengths.of_arguments[opcode], arguments < 0 ? 0xFF : arguments) << opcode;
  }
}

// Whole and damaged frames among noise, with pauses about as long as the gap timeout.
std::vector<TimedByte> RandomStream(Dice* dice) {
  std::vector<TimedByte> stream;
  auto now_ms = static_cast<uint32_t>(0u - dice->Below(500));  // many clocks wrap on the way
  while (stream.size() < 250) {
    Bytes piece = dice->Some(dice->Below(8));
    if (!dice->OneIn(4)) {
      Bytes body = dice->Some(dice->Below(14) + (dice->OneIn(4) ? 60 : 0));  // 0 to 73 bytes
      if (!body.empty() && dice->OneIn(8)) {
        body[0] = 0;
      }
      piece = testing::NaiveEncode(body);
    }
    if (!piece.empty() && dice->OneIn(4)) {
      piece[dice->Below(piece.size())] ^= static_cast<uint8_t>(1u << dice->Below(8));
    }
    if (!piece.empty() && dice->OneIn(8)) {
      piece.resize(dice->Below(piece.size()));
    }
    for (const uint8_t byte : piece) {
      now_ms += static_cast<uint32_t>(dice->OneIn(40) ? dice->Below(40) : dice->Below(2));
      stream.push_back({byte, now_ms});
    }
  }
  return stream;
}

TEST_F(ChipProtocol, ReadsRandomStreamsAsTheNaiveDecoderReadsThem) {
  Dice dice(1284);
  protocol::DecoderCounters sums = {};
  for (int round = 0; round < 400; ++round) {
    const auto stream = RandomStream(&dice);
    const uint16_t gap_ms = round % 4 == 0 ? protocol::kNoGapTimeout : kGapMs;
    const Heard heard = chip_.DecodeStream(stream, gap_ms);
    ASSERT_TRUE(Agree(heard, NaiveDecoder(stream, gap_ms).Run())) << "round " << round;
    sums.frames += heard.counters.frames;
    sums.crc_errors += heard.counters.crc_errors;
    sums.bad_escapes += heard.counters.bad_escapes;
    sums.oversize += heard.counters.oversize;
    sums.runts += heard.counters.runts;
    sums.refused += heard.counters.refused;
    sums.restarts += heard.counters.restarts;
    sums.timeouts += heard.counters.timeouts;
  }
  EXPECT_GT(sums.frames, 1000u);
  for (const uint32_t sum : {sums.crc_errors, sums.bad_escapes, sums.oversize, sums.runts,
                             sums.refused, sums.restarts, sums.timeouts}) {
    EXPECT_GT(sum, 20u) << "the streams leave a rule out";
  }
}

TEST_F(ChipClientCore, SteersWithTheSameBitsAsTheHost) {
  Dice dice(6);
  std::vector<SteerInput> inputs;
  for (int i = 0; i < 8000; ++i) {
    inputs.push_back({i % 2 == 0 ? client::Law::kDifferential : client::Law::kPaper,
                      dice.Any<int16_t>(), dice.Any<int16_t>(),
                      static_cast<int16_t>(dice.Below(client::kMaxSpeedMmS + 1u)),
                      static_cast<uint8_t>(dice.OneIn(2) ? client::kUnitGain : dice.Below(65))});
    if (dice.OneIn(4)) {  // as on a real map: near the unit, and near each other
      inputs.back().left = static_cast<int16_t>(dice.Within(2 * client::kIntensityUnit));
      inputs.back().right = static_cast<int16_t>(inputs.back().left + dice.Within(16));
    }
  }
  const std::vector<client::WheelSpeeds> speeds = chip_.Steer(inputs);
  ASSERT_EQ(speeds.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    const SteerInput& in = inputs[i];
    ASSERT_EQ(speeds[i], client::Steer(in.law, in.left, in.right, in.k_mm_s, in.gain_16ths))
        << in.left << ' ' << in.right << ' ' << in.k_mm_s << ' ' << int{in.gain_16ths};
  }
}

TEST_F(ChipClientCore, SteersFuzzilyWithTheSameBitsAsTheHost) {
  Dice dice(7);
  std::vector<FuzzyInput> inputs;
  for (int i = 0; i < 8000; ++i) {
    const auto error = static_cast<int16_t>(dice.Within(2 * 2048));
    inputs.push_back({{dice.OneIn(8) ? client::kNoError : error},
                      dice.Any<int16_t>(),
                      dice.Any<int16_t>(),
                      static_cast<int16_t>(dice.Below(client::kMaxSpeedMmS + 1u))});
    if (dice.OneIn(2)) {
      inputs.back().left = static_cast<int16_t>(dice.Within(2 * client::kIntensityUnit));
      inputs.back().right = static_cast<int16_t>(inputs.back().left + dice.Within(512));
    }
  }
  const std::vector<FuzzyOutput> outputs = chip_.SteerFuzzy(inputs);
  ASSERT_EQ(outputs.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    const FuzzyInput& in = inputs[i];
    client::FuzzyState state = in.before;
    const client::WheelSpeeds wheels =
        client::SteerFuzzy(in.left, in.right, in.k_mm_s, client::kTunedFuzzy, &state);
    ASSERT_EQ(outputs[i].wheels, wheels) << in.before.error << ' ' << in.left << ' ' << in.right;
    ASSERT_EQ(outputs[i].after.error, state.error);
  }
}

// A net of 0 and 1 tokens as the server has it, and as a robot has it.
struct SafeNet {
  petri::Net net;
  std::vector<client::NetTransition> transitions;
};

SafeNet MakeSafeNet(Dice* dice) {
  SafeNet made;
  const auto places = 1 + dice->Below(client::kMaxNetPlaces);
  for (uint32_t place = 0; place < places; ++place) {
    made.net.places.push_back(
        {.id = "p" + std::to_string(place), .tokens = dice->OneIn(2) ? 1U : 0U});
  }
  const auto count = 1 + dice->Below(client::kMaxNetTransitions);
  for (uint32_t i = 0; i < count; ++i) {
    petri::Transition& transition = made.net.transitions.emplace_back();
    client::NetTransition& bits = made.transitions.emplace_back();
    for (uint32_t place = 0; place < places; ++place) {
      const uint32_t bit = uint32_t{1} << place;
      if (dice->OneIn(places + 1)) {
        transition.takes.push_back({place});
        bits.takes |= bit;
      }
      if (dice->OneIn(places + 1)) {
        transition.gives.push_back({place});
        bits.gives |= bit;
      }
      if (dice->OneIn(4 * places) && (bits.takes & bit) == 0 && (bits.gives & bit) == 0) {
        transition.reads.push_back({place});
        bits.takes |= bit;
        bits.gives |= bit;
      }
      if (dice->OneIn(4 * places)) {
        transition.inhibitors.push_back({place});
        bits.inhibited_by |= bit;
      }
    }
  }
  return made;
}

uint32_t BitsOf(const petri::Marking& marking) {
  uint32_t bits = 0;
  for (Eigen::Index place = 0; place < marking.size(); ++place) {
    bits |= static_cast<uint32_t>(marking[place]) << place;
  }
  return bits;
}

struct Firings {
  int fired = 0;
  int refused = 0;
  int unsafe = 0;
};

// 500 attempts from the initial marking on.
void ExpectSameFirings(ConformanceClient* chip, const SafeNet& made, Dice* dice, Firings* count) {
  petri::Marking marking = petri::InitialMarking(made.net);
  std::vector<uint8_t> tried;
  for (int i = 0; i < 500; ++i) {
    tried.push_back(static_cast<uint8_t>(dice->Below(made.transitions.size())));
  }
  const std::vector<FiringOutput> outputs = chip->FireNet(made.transitions, BitsOf(marking), tried);
  for (size_t i = 0; i < tried.size(); ++i) {
    const bool enabled = petri::IsEnabled(made.net, tried[i], marking);
    const petri::Marking next = petri::Fire(made.net, tried[i], marking);
    const bool legal = enabled && next.maxCoeff() <= 1;
    ++(legal ? count->fired : enabled ? count->unsafe : count->refused);
    if (legal) {
      marking = next;
    }
    ASSERT_EQ(outputs[i].firing == client::Firing::kFired, legal) << i;
    ASSERT_EQ(outputs[i].firing == client::Firing::kUnsafe, enabled && !legal);
    ASSERT_EQ(outputs[i].marking, BitsOf(marking));
  }
}

// 100 000 firings, most of which are refused.
TEST_F(ChipClientCore, FiresNetsAsTheServerDoes) {
  Dice dice(15);
  Firings count;
  for (int run = 0; run < 200; ++run) {
    SCOPED_TRACE(run);
    ExpectSameFirings(&chip_, MakeSafeNet(&dice), &dice, &count);
  }
  EXPECT_GT(count.fired, 10'000);
  EXPECT_GT(count.refused, 10'000);
  EXPECT_GT(count.unsafe, 1'000);
}

TEST_F(ChipClientCore, FiresTheShippedRobotsNetAsTheServerDoes) {
  Result<petri::Net> net =
      nets::LoadSystem(PHEROMONE_SOURCE_DIR "/deploy/examples/nets/robot.toml");
  ASSERT_TRUE(net.ok()) << net.error();
  SafeNet made{std::move(net).value(), {}};
  for (int i = 0; i < client::kRobotNet.transition_count; ++i) {
    made.transitions.push_back(client::kRobotNet.transitions[i].arcs);
  }
  ASSERT_EQ(made.transitions.size(), made.net.transitions.size());
  ASSERT_EQ(client::kRobotNet.marking, BitsOf(petri::InitialMarking(made.net)));
  Dice dice(16);
  Firings count;
  for (int run = 0; run < 20; ++run) {
    SCOPED_TRACE(run);
    ExpectSameFirings(&chip_, made, &dice, &count);
  }
  EXPECT_GT(count.fired, 500);
  EXPECT_EQ(count.fired + count.refused, 10'000);
}

TEST_F(ChipClientCore, SteersCarefullyWithTheSameBitsAsTheHost) {
  using State = client::CarefulState;
  Dice dice(8);
  std::vector<CarefulInput> inputs;
  for (int i = 0; i < 8000; ++i) {
    State before = client::kCarefulStart;
    before.plateau = static_cast<int16_t>(31 + dice.Below(32737));
    before.course = dice.Any<uint16_t>();
    before.turn = static_cast<uint16_t>(dice.Below(client::kAsideAngle + 1u));
    before.mode = static_cast<State::Mode>(dice.Below(3));
    before.aside = static_cast<State::Side>(
        before.mode == State::Mode::kFollowing ? dice.Below(3) : 1 + dice.Below(2));
    before.stronger = static_cast<State::Side>(1 + dice.Below(2));
    before.clear = static_cast<uint8_t>(dice.Below(4));
    inputs.push_back({before, dice.Any<int16_t>(), dice.Any<int16_t>(), dice.Any<uint16_t>(),
                      static_cast<int16_t>(dice.Below(client::kMaxSpeedMmS + 1u))});
    if (dice.OneIn(2)) {  // as on a trail
      inputs.back().left = static_cast<int16_t>(dice.Below(client::kIntensityUnit));
      inputs.back().right = static_cast<int16_t>(inputs.back().left + dice.Within(1024));
    }
  }
  const std::vector<CarefulOutput> outputs = chip_.SteerCareful(inputs);
  ASSERT_EQ(outputs.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    const CarefulInput& in = inputs[i];
    State state = in.before;
    client::Notice(in.left, in.right, in.heading, &state);
    ASSERT_EQ(outputs[i].wheels,
              client::SteerCareful(in.left, in.right, in.k_mm_s, client::kUnitGain, state))
        << in.left << ' ' << in.right << ' ' << in.k_mm_s;
    ASSERT_EQ(outputs[i].search, client::Search(in.k_mm_s, state));
    const State& after = outputs[i].after;
    ASSERT_EQ(std::tie(after.plateau, after.course, after.turn, after.mode, after.aside,
                       after.stronger, after.clear),
              std::tie(state.plateau, state.course, state.turn, state.mode, state.aside,
                       state.stronger, state.clear));
  }
}

TEST_F(ChipClientCore, HasTheSameSineOfEveryAngleAsTheHost) {
  std::vector<client::BinaryAngle> angles(65536);
  std::iota(angles.begin(), angles.end(), client::BinaryAngle{0});
  const auto sines = chip_.Sine(angles);
  ASSERT_EQ(sines.size(), angles.size());
  for (const client::BinaryAngle angle : angles) {
    ASSERT_EQ(sines[angle], std::pair(client::SinQ14(angle), client::CosQ14(angle))) << angle;
  }
}

TEST_F(ChipClientCore, PlacesOdometryOnTheSameSpotAsTheHost) {
  Dice dice(5);
  std::vector<PlaceInput> inputs;
  for (int i = 0; i < 4000; ++i) {
    constexpr int32_t kMax = client::kMaxCoordinateMm;
    inputs.push_back({{dice.Within(kMax), dice.Within(kMax), dice.Any<uint16_t>()},
                      {dice.Within(kMax + 100), dice.Within(kMax + 100), dice.Any<uint16_t>()}});
    if (dice.OneIn(8)) {
      inputs.back().odometry.x_mm = dice.Any<int32_t>();
    }
  }
  for (int i = 0; i < 100; ++i) {  // an odd sine or cosine makes half a millimetre: rounded up
    inputs.push_back({{0, 0, dice.Any<uint16_t>()}, {8192, 0, 0}});
    inputs.push_back({{0, 0, dice.Any<uint16_t>()}, {0, -8192, 0}});
  }
  const std::vector<client::Pose> poses = chip_.Place(inputs);
  ASSERT_EQ(poses.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    const client::Pose expected = client::StartPose(inputs[i].start).Place(inputs[i].odometry);
    ASSERT_EQ(poses[i].x_mm, expected.x_mm) << i;
    ASSERT_EQ(poses[i].y_mm, expected.y_mm) << i;
    ASSERT_EQ(poses[i].heading, expected.heading) << i;
  }
}

TEST_F(ChipClientCore, ConvertsToTheSamePoseUnitsAsTheHost) {
  Dice dice(4);
  std::vector<UnitsInput> inputs;
  for (int i = 0; i < 4000; ++i) {
    const int32_t mm =
        dice.OneIn(4) ? dice.Any<int32_t>() : dice.Within(client::kMaxCoordinateMm + 100);
    inputs.push_back({mm, dice.Any<uint16_t>()});
  }
  const std::vector<UnitsOutput> outputs = chip_.ToPoseUnits(inputs);
  ASSERT_EQ(outputs.size(), inputs.size());
  for (size_t i = 0; i < inputs.size(); ++i) {
    int32_t units = 0;
    const bool done = client::ToPoseUnits(inputs[i].mm, inputs[i].unit_10um, &units);
    ASSERT_EQ(outputs[i].done, done) << inputs[i].mm << ' ' << inputs[i].unit_10um;
    ASSERT_EQ(outputs[i].units, done ? units : 0) << inputs[i].mm << ' ' << inputs[i].unit_10um;
  }
}

}  // namespace
}  // namespace pheromone::conformance
