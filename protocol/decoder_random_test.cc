// The decoder against the naive one over very many streams: all short ones, random bytes, and a
// million frames, whole and damaged. Every stream is the same in every run.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "protocol/decoder.h"
#include "protocol/testing/listen.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::Agree;
using testing::Bytes;
using testing::Heard;
using testing::Listen;
using testing::LoadFrame;
using testing::NaiveDecoder;
using testing::NaiveResult;
using testing::TimedByte;

constexpr uint16_t kGapMs = 20;

// Random choices, the same on every machine.
class Dice {
 public:
  explicit Dice(uint64_t seed) : generator_(seed) {}

  size_t Below(size_t limit) { return static_cast<size_t>(generator_() % limit); }
  bool OneIn(size_t limit) { return Below(limit) == 0; }

  /// Any byte, but the ones that mean something much more often than the others.
  uint8_t Byte() {
    constexpr uint8_t kLoaded[] = {kDle, kDle, kDle, kStx, kEtx, 0};
    const size_t roll = Below(16);
    return roll < sizeof(kLoaded) ? kLoaded[roll] : static_cast<uint8_t>(Below(256));
  }

  Bytes Some(size_t size) {
    Bytes bytes(size);
    for (uint8_t& byte : bytes) {
      byte = Byte();
    }
    return bytes;
  }

 private:
  std::mt19937_64 generator_;
};

// Every stream of up to `longest` bytes of an alphabet in which every rule can be said.
template <typename OnStream>
void ForEachShortStream(size_t longest, OnStream&& on_stream) {
  const Bytes alphabet{kDle, kStx, kEtx, 0x00, 0x55};
  size_t count = 1;
  for (size_t length = 0; length <= longest; ++length, count *= alphabet.size()) {
    for (size_t number = 0; number < count; ++number) {
      Bytes stream;
      for (size_t rest = number; stream.size() < length; rest /= alphabet.size()) {
        stream.push_back(alphabet[rest % alphabet.size()]);
      }
      on_stream(stream);
    }
  }
}

void ExpectEverythingCounted(const NaiveResult& naive, const Heard& heard, size_t size) {
  const DecoderCounters& c = heard.counters;
  ASSERT_EQ(c.frames, heard.bodies.size());
  ASSERT_EQ(c.frames + c.crc_errors + c.bad_escapes + c.oversize + c.runts + c.refused +
                c.restarts + c.timeouts + (heard.frame_open ? 1u : 0u),
            naive.starts)
      << "each start has one end";
  ASSERT_LE(c.ignored_bytes + 2u * naive.starts, size);
}

TEST(FrameDecoderStreams, AllShortStreamsAreReadAsTheNaiveDecoderReadsThem) {
  ForEachShortStream(8, [](const Bytes& bytes) {
    std::vector<TimedByte> stream;
    Append(bytes, 0, &stream);
    const Heard heard = Listen(stream, kGapMs);
    const NaiveResult naive = NaiveDecoder(stream, kGapMs).Run();
    if (!Agree(heard, naive)) {
      ADD_FAILURE() << ::testing::PrintToString(bytes);
    }
    ExpectEverythingCounted(naive, heard, bytes.size());
  });
}

TEST(FrameDecoderStreams, AllShortFramesAreReadAsTheNaiveDecoderReadsThem) {
  ForEachShortStream(6, [](const Bytes& inside) {
    std::vector<TimedByte> stream;
    Append({kDle, kStx}, 0, &stream);
    Append(inside, 0, &stream);
    Append({kDle, kEtx}, 0, &stream);
    if (!Agree(Listen(stream, kGapMs), NaiveDecoder(stream, kGapMs).Run())) {
      ADD_FAILURE() << ::testing::PrintToString(inside);
    }
  });
}

TEST(FrameDecoderStreams, RandomBytesAreReadAsTheNaiveDecoderReadsThem) {
  Dice dice(1);
  for (int round = 0; round < 2000; ++round) {
    std::vector<TimedByte> stream;
    uint32_t now_ms = static_cast<uint32_t>(0u - dice.Below(1000));  // wraps in every other round
    for (int i = 0; i < 500; ++i) {
      now_ms += static_cast<uint32_t>(dice.OneIn(50) ? dice.Below(kGapMs + 3) : 0);
      stream.push_back({dice.Byte(), now_ms});
    }
    for (const uint16_t gap_timeout_ms : {kGapMs, kNoGapTimeout}) {
      const Heard heard = Listen(stream, gap_timeout_ms);
      const NaiveResult naive = NaiveDecoder(stream, gap_timeout_ms).Run();
      ASSERT_TRUE(Agree(heard, naive)) << "round " << round;
      ExpectEverythingCounted(naive, heard, stream.size());
    }
  }
}

// A body that a frame can hold, most of them short.
Bytes RandomBody(Dice* dice) {
  Bytes body = dice->Some(2 + dice->Below(dice->OneIn(8) ? kMaxData + 1u : 12u));
  if (!dice->OneIn(100)) {
    body[0] = static_cast<uint8_t>(body[0] | 1u);
    body[1] = static_cast<uint8_t>(body[1] | 1u);
  }
  return body;
}

void DamageOnce(Dice* dice, Bytes* wire) {
  const size_t at = dice->Below(wire->size());
  const auto where = wire->begin() + static_cast<std::ptrdiff_t>(at);
  switch (dice->Below(6)) {
    case 0:
      *where = static_cast<uint8_t>(*where ^ (1u << dice->Below(8)));
      break;
    case 1:
      *where = dice->Byte();
      break;
    case 2:
      wire->erase(where);
      break;
    case 3:
      wire->insert(where, dice->Byte());
      break;
    case 4:
      wire->erase(where, wire->end());
      break;
    default: {
      const Bytes more = dice->Some(dice->Below(100));
      wire->insert(where, more.begin(), more.end());
      break;
    }
  }
}

TEST(FrameDecoderStreams, AMillionFramesWholeAndDamaged) {
  constexpr int kRounds = 1000;
  constexpr int kFramesARound = 1000;
  Dice dice(2);
  uint64_t delivered = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<TimedByte> stream;
    uint32_t now_ms = 0;
    for (int frame = 0; frame < kFramesARound; ++frame) {
      Bytes wire = testing::NaiveEncode(RandomBody(&dice));
      const bool damaged = dice.OneIn(2);
      while (damaged && !wire.empty()) {
        DamageOnce(&dice, &wire);
        if (!dice.OneIn(3)) {
          break;
        }
      }
      for (const uint8_t byte : wire) {
        now_ms += damaged && dice.OneIn(200) ? kGapMs + static_cast<uint32_t>(dice.Below(2)) : 0;
        stream.push_back({byte, now_ms});
      }
      now_ms += dice.OneIn(2) ? kGapMs + 1u : 0;
    }
    const uint16_t gap_timeout_ms = round % 4 == 0 ? kNoGapTimeout : kGapMs;
    const Heard heard = Listen(stream, gap_timeout_ms);
    const NaiveResult naive = NaiveDecoder(stream, gap_timeout_ms).Run();
    ASSERT_TRUE(Agree(heard, naive)) << "round " << round;
    ExpectEverythingCounted(naive, heard, stream.size());
    delivered += heard.bodies.size();
  }
  EXPECT_GE(delivered, 400000u) << "too much damage to be of use";
  EXPECT_LE(delivered, 600000u) << "too little damage to be of use";
}

// ---- The pad byte: with no gap timeout to end a broken frame, one 0x00 before DLE STX does.

TEST(FrameDecoderPad, OneZeroByteSavesTheFrameWhateverStoodBefore) {
  const testing::FrameVector good = LoadFrame("sense_data_is_all_dle");
  ForEachShortStream(7, [&good](Bytes stream) {
    stream.push_back(0x00);
    stream.insert(stream.end(), good.wire.begin(), good.wire.end());
    const Heard heard = Listen(stream, kNoGapTimeout);
    ASSERT_FALSE(heard.bodies.empty()) << ::testing::PrintToString(stream);
    ASSERT_EQ(heard.bodies.back(), *good.body) << ::testing::PrintToString(stream);
  });
}

TEST(FrameDecoderPad, OneZeroByteSavesTheFrameAfterRandomGarbage) {
  const testing::FrameVector good = LoadFrame("ping_longest_all_dle");
  Dice dice(3);
  int swallowed_without = 0;
  for (int round = 0; round < 100000; ++round) {
    Bytes stream = dice.Some(dice.Below(150));
    FrameParser parser;
    for (const uint8_t byte : stream) {
      parser.Push(byte);
    }
    if (parser.coded()) {
      continue;  // its end is counted
    }
    Bytes without = stream;
    stream.push_back(0x00);
    stream.insert(stream.end(), good.wire.begin(), good.wire.end());
    const Heard heard = Listen(stream, kNoGapTimeout);
    ASSERT_FALSE(heard.bodies.empty()) << ::testing::PrintToString(stream);
    ASSERT_EQ(heard.bodies.back(), *good.body) << ::testing::PrintToString(stream);

    without.insert(without.end(), good.wire.begin(), good.wire.end());
    const Heard unpadded = Listen(without, kNoGapTimeout);
    swallowed_without += unpadded.bodies.empty() || unpadded.bodies.back() != *good.body ? 1 : 0;
  }
  EXPECT_GT(swallowed_without, 1000) << "the garbage does not put the pad to the test";
}

}  // namespace
}  // namespace pheromone::protocol
