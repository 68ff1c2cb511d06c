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
#include "protocol/testing/message_fields.h"
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
    EXPECT_EQ(all[0].encoded, body);
    testing::WithMessage(
        vector, [&](const auto& message) { EXPECT_EQ(all[0].text, testing::TextOf(message)); });
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
