#include "protocol/coded_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "protocol/decoder.h"
#include "protocol/messages.h"
#include "protocol/testing/listen.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::Agree;
using testing::Bytes;
using testing::Listen;
using testing::NaiveDecoder;

Bytes Coded(const Bytes& body) {
  Bytes wire(kMaxCoded);
  wire.resize(EncodeCoded(testing::ToMessage(body), wire.data()));
  return wire;
}

Bytes RoundWith(int answers, int turns) {
  Round round;
  round.number = 77;
  round.turn_ms = 18;
  round.answer_count = static_cast<uint8_t>(answers);
  round.turn_count = static_cast<uint8_t>(turns);
  for (int i = 0; i < answers; ++i) {
    round.answers[i] = {static_cast<int16_t>(1000 - 301 * i), static_cast<int16_t>(-7 * i)};
  }
  for (int i = 0; i < turns; ++i) {
    round.turns[i] = static_cast<uint8_t>(i + 1);
  }
  Message message;
  Encode(round, &message);
  return testing::ToBody(message);
}

// The answer to a first HELLO has 34 bytes of DATA, that to a second one 20.
Bytes HelloAnswerOf(size_t data) {
  Bytes body{0x2A, 0xF1};
  for (size_t i = 0; i < data; ++i) {
    body.push_back(static_cast<uint8_t>(37 * i + data));
  }
  return body;
}

TEST(CodedFrameTest, IsWrittenAsTheVectorsHaveIt) {
  int compared = 0;
  for (const auto& [frame, stream] : {std::pair{"round_empty", "coded_round_empty"},
                                      std::pair{"round_several", "coded_round_several"},
                                      std::pair{"round_dle", "coded_round_dle"},
                                      std::pair{"round_largest", "coded_round_largest"}}) {
    for (const testing::StreamVector& vector : testing::LoadStreams()) {
      if (vector.name == stream) {
        EXPECT_EQ(Coded(*testing::LoadFrame(frame).body), vector.bytes) << frame;
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 4);
}

TEST(CodedFrameTest, EverySizeArrives) {
  for (int answers = 0; answers <= kMaxTurns; ++answers) {
    for (int turns = 0; turns <= kMaxTurns; ++turns) {
      const Bytes body = RoundWith(answers, turns);
      const Bytes wire = Coded(body);
      EXPECT_EQ(wire.size(), CodedBytes(body.size() - 2));
      EXPECT_EQ(Listen(wire, kNoGapTimeout).bodies, std::vector<Bytes>{body});
    }
  }
}

// Whatever its value: a delimiter, too.
TEST(CodedFrameTest, ArrivesWithAnyOneByteDamaged) {
  for (const Bytes& body : {RoundWith(0, 2), RoundWith(4, 4), RoundWith(11, 11), HelloAnswerOf(34),
                            HelloAnswerOf(20)}) {
    const bool is_round = body[1] == kRound;
    const Bytes wire = Coded(body);
    for (size_t at = 0; at < wire.size(); ++at) {
      for (int value = 0; value < 256; ++value) {
        Bytes damaged = wire;
        damaged[at] = static_cast<uint8_t>(value);
        // It says that there is no second beginning, hides its DLE, or tells another number of
        // rows. HELLO's answer has its ID in the first one.
        if ((at == 2 && !is_round && value != kBroadcastId) ||
            (at == 3 && value == (wire[3] | kCodedAgain)) ||
            (at == 4 && (value == kDle || ReadRows(static_cast<uint8_t>(value)) != 0))) {
          continue;
        }
        const testing::Heard heard = Listen(damaged, kNoGapTimeout);
        ASSERT_EQ(heard.bodies, std::vector<Bytes>{body}) << at << ' ' << value;
      }
    }
  }
}

TEST(CodedFrameTest, AnAnswerToHelloIsForTheRobotOfItsBeginning) {
  for (const size_t data : {size_t{34}, size_t{20}}) {
    const Bytes body = HelloAnswerOf(data);
    Bytes wire = Coded(body);
    EXPECT_EQ(Listen(wire, kNoGapTimeout).bodies, std::vector<Bytes>{body});
    wire[2] = 0x2B;
    EXPECT_TRUE(Listen(wire, kNoGapTimeout).bodies.empty());
  }
}

TEST(CodedFrameTest, ArrivesAfterAnyBurstOfARowsLength) {
  const Bytes body = RoundWith(8, 8);
  const Bytes wire = Coded(body);
  const size_t rows = wire[4] % 16u;
  for (size_t at = 10; at + rows <= wire.size(); ++at) {
    Bytes damaged = wire;
    for (size_t i = 0; i < rows; ++i) {
      damaged[at + i] ^= static_cast<uint8_t>(0x31 + i);
    }
    ASSERT_EQ(Listen(damaged, kNoGapTimeout).bodies, std::vector<Bytes>{body}) << at;
  }
}

// With damage from none to much: the decoder finds what the naive one finds, and what it delivers
// is what was sent.
TEST(CodedFrameTest, RandomDamageIsRepairedAsTheNaiveDecoderDoes) {
  std::mt19937_64 random(5);
  int delivered = 0;
  int lost = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Bytes body = trial % 4 == 0 ? HelloAnswerOf(trial % 8 == 0 ? 34 : 20)
                                      : RoundWith(static_cast<int>(random() % 12),
                                                  static_cast<int>(random() % 12));
    Bytes wire = Coded(body);
    const unsigned per_mille = static_cast<unsigned>(random() % 4) * 40;
    for (uint8_t& byte : wire) {
      byte = random() % 1000 < per_mille ? static_cast<uint8_t>(random() % 256) : byte;
    }
    std::vector<testing::TimedByte> stream;
    testing::Append(wire, 0, &stream);
    const testing::Heard heard = Listen(stream, 20);
    const testing::NaiveResult naive = NaiveDecoder(stream, 20).Run();
    ASSERT_TRUE(Agree(heard, naive)) << "trial " << trial;
    if (heard.bodies.empty()) {
      ++lost;
    } else {
      ASSERT_EQ(heard.bodies[0], body);
      ++delivered;
    }
  }
  EXPECT_GT(delivered, 2500);
  EXPECT_GT(lost, 400);
}

TEST(CodedFrameTest, RandomBytesBehindABeginningAreReadAsTheNaiveDecoderReadsThem) {
  std::mt19937_64 random(6);
  for (int trial = 0; trial < 3000; ++trial) {
    Bytes wire{0x10, 0x02, random() % 2 != 0 ? uint8_t{0xFF} : uint8_t{0x2A},
               static_cast<uint8_t>(0xF4 + random() % 4),
               SayRows(static_cast<uint8_t>(random() % 16))};
    const size_t more = random() % 120;
    for (size_t i = 0; i < more; ++i) {
      wire.push_back(random() % 8 == 0 ? kDle : static_cast<uint8_t>(random() % 256));
    }
    std::vector<testing::TimedByte> stream;
    uint32_t now_ms = 0;
    for (const uint8_t byte : wire) {
      now_ms += random() % 100 == 0 ? 21u : 0u;
      stream.push_back({byte, now_ms});
    }
    ASSERT_TRUE(Agree(Listen(stream, 20), NaiveDecoder(stream, 20).Run())) << "trial " << trial;
  }
}

}  // namespace
}  // namespace pheromone::protocol
