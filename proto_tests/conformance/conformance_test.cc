// The protocol on a microcontroller: the vectors of protocol/vectors, and random streams against
// the naive decoder. The same test is linked once for each chip (target.h).
#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "proto_tests/conformance/chip_test.h"
#include "proto_tests/conformance/client.h"
#include "protocol/testing/listen.h"
#include "protocol/testing/message_table.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"

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

using ChipProtocol = ChipTest;

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

}  // namespace
}  // namespace pheromone::conformance
