// Every small damage to every vector frame. Held against the naive decoder throughout; beyond that,
// against what the receiving rules promise: damage is never mistaken for the message, and the next
// good frame is always heard.
//
// Some damaged frames do pass the CRC, which cannot be helped: a byte more or less in the middle by
// accident, a zero byte more at the end by design of this CRC. They have another length, and it is
// the exact length of each opcode that keeps them out.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "protocol/decoder.h"
#include "protocol/testing/listen.h"
#include "protocol/testing/message_table.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::AcceptedAs;
using testing::Agree;
using testing::Bytes;
using testing::FrameVector;
using testing::Heard;
using testing::Listen;
using testing::LoadFrame;
using testing::LoadFrames;
using testing::NaiveDecoder;
using testing::TimedByte;
using testing::ToMessage;

constexpr uint16_t kGapMs = 20;
const char* const kHoldsFalseFrame = "opcode_tag_answer_holds_false_frame";

class Damage : public ::testing::Test {
 protected:
  // Sends `damaged` and, once the gap timeout has passed, a good frame. Returns what was delivered
  // before the good one; fails if that was not delivered last, or if the naive decoder disagrees.
  std::vector<Bytes> HeardOf(const Bytes& damaged) const {
    std::vector<TimedByte> stream;
    Append(damaged, 0, &stream);
    Append(good_.wire, kGapMs + 1, &stream);
    Heard heard = Listen(stream, kGapMs);
    EXPECT_TRUE(Agree(heard, NaiveDecoder(stream, kGapMs).Run())) << "unlike the naive decoder";
    if (heard.bodies.empty() || heard.bodies.back() != *good_.body) {
      ADD_FAILURE() << "the good frame after the damaged one was lost";
      return heard.bodies;
    }
    heard.bodies.pop_back();
    return heard.bodies;
  }

  // Fails if anything in `heard` could be acted upon: no opcode and length of a message, or at most
  // a PING of another payload, which its sender does not take for the echo, or a SYMBOL of another
  // text, which its sender finds by RESOLVE.
  static void ExpectHarmless(const std::vector<Bytes>& heard, const FrameVector& original) {
    for (const Bytes& body : heard) {
      EXPECT_NE(body, *original.body);
      for (const std::string& name : AcceptedAs(ToMessage(body))) {
        EXPECT_TRUE(name == "PING" || name == "PING_ANSWER" || name == "SYMBOL")
            << "taken for " << name;
      }
    }
  }

  const std::vector<FrameVector> frames_ = LoadFrames();
  const FrameVector good_ = LoadFrame("ping_nonce");
};

std::ptrdiff_t Offset(size_t at) {
  return static_cast<std::ptrdiff_t>(at);
}

TEST_F(Damage, AFrameJoinedInTheMiddleIsNotHeard) {
  for (const FrameVector& vector : frames_) {
    for (size_t from = 1; from <= vector.wire.size(); ++from) {
      SCOPED_TRACE(vector.name + " from byte " + std::to_string(from));
      const std::vector<Bytes> heard =
          HeardOf(Bytes(vector.wire.begin() + Offset(from), vector.wire.end()));
      if (vector.name == kHoldsFalseFrame && from <= 5) {
        // Outside of a frame, the second DLE of a pair begins one as well as any other.
        EXPECT_EQ(heard, (std::vector<Bytes>{{0x05, 0x20, 0x11, 0x22}}));
      } else {
        EXPECT_TRUE(heard.empty());
      }
    }
  }
}

TEST_F(Damage, TheFalseFrameInsideAnotherIsRefusedByOpcodeAndLength) {
  EXPECT_TRUE(AcceptedAs(ToMessage({0x05, 0x20, 0x11, 0x22})).empty());
}

TEST_F(Damage, AFrameCutShortIsNotHeard) {
  for (const FrameVector& vector : frames_) {
    for (size_t to = 0; to < vector.wire.size(); ++to) {
      SCOPED_TRACE(vector.name + " up to byte " + std::to_string(to));
      EXPECT_TRUE(HeardOf(Bytes(vector.wire.begin(), vector.wire.begin() + Offset(to))).empty());
    }
  }
}

TEST_F(Damage, AFrameWithOneChangedByteIsNotHeard) {
  for (const FrameVector& vector : frames_) {
    for (size_t at = 0; at < vector.wire.size(); ++at) {
      SCOPED_TRACE(vector.name + ", byte " + std::to_string(at));
      for (unsigned flip = 1; flip <= 0xFF; ++flip) {
        Bytes damaged = vector.wire;
        damaged[at] = static_cast<uint8_t>(damaged[at] ^ flip);
        const std::vector<Bytes> heard = HeardOf(damaged);
        // The vectors that are damaged from the start may be repaired by damage: there, what counts
        // is that the naive decoder hears the same.
        if (vector.delivered() && vector.name != kHoldsFalseFrame) {
          ASSERT_TRUE(heard.empty()) << "changed by " << flip;
        }
      }
    }
  }
}

TEST_F(Damage, AFrameWithOneMissingByteIsNotTakenForAMessage) {
  for (const FrameVector& vector : frames_) {
    for (size_t at = 0; at < vector.wire.size(); ++at) {
      SCOPED_TRACE(vector.name + " without byte " + std::to_string(at));
      Bytes damaged = vector.wire;
      damaged.erase(damaged.begin() + Offset(at));
      const std::vector<Bytes> heard = HeardOf(damaged);
      if (vector.verdict == "ok") {
        ExpectHarmless(heard, vector);
      }
    }
  }
}

// One byte more. The frame survives a byte before its DLE STX or after its DLE ETX, and nothing
// else.
TEST_F(Damage, AFrameWithOneByteMoreIsNotTakenForAMessage) {
  for (const FrameVector& vector : frames_) {
    const size_t size = vector.wire.size();
    for (size_t at = 0; at <= size; ++at) {
      SCOPED_TRACE(vector.name + ", before byte " + std::to_string(at));
      for (unsigned value = 0; value <= 0xFF; ++value) {
        Bytes damaged = vector.wire;
        damaged.insert(damaged.begin() + Offset(at), static_cast<uint8_t>(value));
        const std::vector<Bytes> heard = HeardOf(damaged);
        // DLE [DLE] STX: the same bytes as [DLE] DLE STX. DLE [ETX] ETX: as DLE ETX [ETX].
        const bool outside = at == 0 || at == size || (at == 1 && value == kDle) ||
                             (at + 1 == size && value == kEtx);
        if (outside && vector.delivered()) {
          ASSERT_EQ(heard, std::vector<Bytes>{*vector.body}) << "with " << value;
        } else if (vector.verdict == "ok") {
          ExpectHarmless(heard, vector);
        }
        if (HasFailure()) {
          return;
        }
      }
    }
  }
}

// The register is 0 behind the CRC and stays 0 under zeros: the frame passes as one byte longer.
TEST_F(Damage, AZeroBeforeTheEndPassesTheCrcAndIsKeptOutByTheLength) {
  int kept_out = 0;
  for (const FrameVector& vector : frames_) {
    if (vector.verdict != "ok") {
      continue;
    }
    SCOPED_TRACE(vector.name);
    Bytes damaged = vector.wire;
    damaged.insert(damaged.end() - 2, 0x00);
    Bytes longer = *vector.body;
    longer.push_back(static_cast<uint8_t>(testing::NaiveCrc16(longer) & 0xFF));
    const std::vector<Bytes> heard = HeardOf(damaged);
    if (vector.body->size() == 2u + kMaxData) {
      EXPECT_TRUE(heard.empty());  // no frame is that long
      continue;
    }
    EXPECT_EQ(heard, std::vector<Bytes>{longer});
    ExpectHarmless(heard, vector);
    kept_out += AcceptedAs(ToMessage(longer)).empty() ? 1 : 0;
  }
  EXPECT_GE(kept_out, 80);
}

}  // namespace
}  // namespace pheromone::protocol
