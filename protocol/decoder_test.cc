// What a decoder makes of whole frames and of time. Damage: decoder_damage_test.cc; random streams:
// decoder_random_test.cc.
#include "protocol/decoder.h"

#include <gtest/gtest.h>

#include <vector>

#include "protocol/testing/listen.h"
#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::Agree;
using testing::Bytes;
using testing::FrameVector;
using testing::Heard;
using testing::Listen;
using testing::LoadFrame;
using testing::LoadFrames;
using testing::NaiveDecoder;
using testing::TimedByte;
using testing::ToBody;

constexpr uint16_t kGapMs = 20;

std::vector<Bytes> ExpectedFrom(const FrameVector& vector) {
  return vector.delivered() ? std::vector<Bytes>{*vector.body} : std::vector<Bytes>{};
}

// The counter that stands for a verdict.
uint32_t CountOf(const FrameVector& vector, const DecoderCounters& counters) {
  if (vector.verdict == "refused") {
    return counters.refused;
  }
  if (vector.verdict == "bad-crc") {
    return counters.crc_errors;
  }
  if (vector.verdict == "bad-escape") {
    return counters.bad_escapes;
  }
  if (vector.verdict == "oversize") {
    return counters.oversize;
  }
  if (vector.verdict == "runt") {
    return counters.runts;
  }
  return vector.delivered() ? counters.frames : 0;
}

// How many frames began and ended, one way or another.
uint32_t Ended(const DecoderCounters& c) {
  return c.frames + c.crc_errors + c.bad_escapes + c.oversize + c.runts + c.refused + c.restarts +
         c.timeouts;
}

TEST(FrameDecoder, MatchesEveryVectorByteByByte) {
  for (const FrameVector& vector : LoadFrames()) {
    const Heard heard = Listen(vector.wire, kGapMs);
    EXPECT_EQ(heard.bodies, ExpectedFrom(vector)) << vector.name;
    EXPECT_EQ(CountOf(vector, heard.counters), 1u) << vector.name;
    EXPECT_EQ(Ended(heard.counters), 1u) << vector.name;
    EXPECT_FALSE(heard.frame_open) << vector.name;
  }
}

TEST(FrameDecoder, DeliversWithTheLastByteAndNotBefore) {
  for (const FrameVector& vector : LoadFrames()) {
    FrameDecoder decoder(kGapMs);
    for (size_t i = 0; i < vector.wire.size(); ++i) {
      const bool last = i + 1 == vector.wire.size();
      ASSERT_EQ(decoder.Push(vector.wire[i], 0), last && vector.delivered())
          << vector.name << ", byte " << i;
    }
  }
}

TEST(FrameDecoder, MatchesEveryVectorInEveryTwoWaySplit) {
  for (const FrameVector& vector : LoadFrames()) {
    for (size_t split = 0; split <= vector.wire.size(); ++split) {
      FrameDecoder decoder(kGapMs);
      std::vector<Bytes> bodies;
      const auto keep = [&](const Message& message) { bodies.push_back(ToBody(message)); };
      decoder.PushBlock(vector.wire.data(), split, 0, keep);
      decoder.PushBlock(vector.wire.data() + split, vector.wire.size() - split, kGapMs, keep);
      ASSERT_EQ(bodies, ExpectedFrom(vector)) << vector.name << ", split at " << split;
    }
  }
}

TEST(FrameDecoder, DeliversAllFramesOfOneBlockInOrder) {
  Bytes block;
  std::vector<Bytes> expected;
  for (const FrameVector& vector : LoadFrames()) {
    if (vector.delivered()) {
      block.insert(block.end(), vector.wire.begin(), vector.wire.end());
      expected.push_back(*vector.body);
    }
  }
  FrameDecoder decoder(kGapMs);
  std::vector<Bytes> bodies;
  decoder.PushBlock(block.data(), block.size(), 0,
                    [&](const Message& message) { bodies.push_back(ToBody(message)); });
  EXPECT_EQ(bodies, expected);
  EXPECT_EQ(decoder.counters().frames, expected.size());
  EXPECT_EQ(Ended(decoder.counters()), expected.size());
  EXPECT_EQ(decoder.counters().ignored_bytes, 0u);
}

TEST(FrameDecoder, MatchesEveryStreamVector) {
  for (const testing::StreamVector& vector : testing::LoadStreams()) {
    EXPECT_EQ(Listen(vector.bytes, kNoGapTimeout).bodies, vector.delivered) << vector.name;
    EXPECT_EQ(Listen(vector.bytes, kGapMs).bodies, vector.delivered) << vector.name;
  }
}

TEST(FrameDecoder, KeepsTheMessageUntilTheNextByte) {
  const FrameVector good = LoadFrame("ping_longest");
  FrameDecoder decoder(kGapMs);
  decoder.PushBlock(good.wire.data(), good.wire.size(), 0, [](const Message&) {});
  decoder.Expire(1000);
  EXPECT_EQ(ToBody(decoder.message()), *good.body);
}

TEST(FrameDecoder, SaysWhetherAFrameIsOpen) {
  const FrameVector good = LoadFrame("sense_id_is_dle");
  FrameDecoder decoder(kGapMs);
  EXPECT_FALSE(decoder.frame_open());
  for (size_t i = 0; i < good.wire.size(); ++i) {
    decoder.Push(good.wire[i], 0);
    EXPECT_EQ(decoder.frame_open(), i >= 1 && i + 1 < good.wire.size()) << "after byte " << i;
  }
}

// ---- Time

// The bytes of `wire`, `gap_ms` apart, from `start_ms` on; the gap before byte `slow` is `slow_ms`.
std::vector<TimedByte> Paced(const Bytes& wire, uint32_t start_ms, uint32_t gap_ms, size_t slow,
                             uint32_t slow_ms) {
  std::vector<TimedByte> stream;
  uint32_t now_ms = start_ms;
  for (size_t i = 0; i < wire.size(); ++i) {
    if (i > 0) {
      now_ms += i == slow ? slow_ms : gap_ms;
    }
    stream.push_back({wire[i], now_ms});
  }
  return stream;
}

TEST(FrameDecoderTime, GapsOfExactlyTheTimeoutAreAllowed) {
  for (const FrameVector& vector : LoadFrames()) {
    const Heard heard = Listen(Paced(vector.wire, 5, kGapMs, 1, kGapMs), kGapMs);
    EXPECT_EQ(heard.bodies, ExpectedFrom(vector)) << vector.name;
    EXPECT_EQ(heard.counters.timeouts, 0u) << vector.name;
  }
}

TEST(FrameDecoderTime, AGapOneMillisecondLongerDiscardsTheFrame) {
  for (const FrameVector& vector : LoadFrames()) {
    if (!vector.delivered() || vector.name == "opcode_tag_answer_holds_false_frame") {
      continue;
    }
    for (size_t slow = 1; slow < vector.wire.size(); ++slow) {
      const auto stream = Paced(vector.wire, 5, 0, slow, kGapMs + 1);
      const Heard heard = Listen(stream, kGapMs);
      ASSERT_TRUE(heard.bodies.empty()) << vector.name << ", gap before byte " << slow;
      // Before byte 1, no frame has begun: a lone DLE is ignored.
      ASSERT_EQ(heard.counters.timeouts, slow == 1 ? 0u : 1u) << vector.name << ", " << slow;
      ASSERT_TRUE(Agree(heard, NaiveDecoder(stream, kGapMs).Run())) << vector.name << ", " << slow;
    }
  }
}

TEST(FrameDecoderTime, TheFrameAfterATimeoutIsDelivered) {
  const FrameVector good = LoadFrame("ping_nonce");
  for (const FrameVector& vector : LoadFrames()) {
    for (size_t cut = 1; cut < vector.wire.size(); ++cut) {
      std::vector<TimedByte> stream;
      Append(Bytes(vector.wire.begin(), vector.wire.begin() + static_cast<std::ptrdiff_t>(cut)), 0,
             &stream);
      Append(good.wire, kGapMs + 1, &stream);
      const Heard heard = Listen(stream, kGapMs);
      ASSERT_FALSE(heard.bodies.empty()) << vector.name << " cut to " << cut;
      ASSERT_EQ(heard.bodies.back(), *good.body) << vector.name << " cut to " << cut;
    }
  }
}

TEST(FrameDecoderTime, TheClockMayWrapInsideAFrame) {
  const FrameVector good = LoadFrame("ping_longest");
  for (size_t slow = 1; slow < good.wire.size(); ++slow) {
    // Byte `slow - 1` comes 7 ms before the wrap, byte `slow` after it.
    const uint32_t start_ms = 0u - 7u;
    EXPECT_EQ(Listen(Paced(good.wire, start_ms, 0, slow, kGapMs), kGapMs).bodies,
              std::vector<Bytes>{*good.body})
        << slow;
    EXPECT_TRUE(Listen(Paced(good.wire, start_ms, 0, slow, kGapMs + 1), kGapMs).bodies.empty())
        << slow;
  }
}

TEST(FrameDecoderTime, TheLongestTimeoutIsNotCutShort) {
  const FrameVector good = LoadFrame("ping_nonce");
  constexpr uint16_t kLongest = 65535;
  EXPECT_EQ(Listen(Paced(good.wire, 0, kLongest, 1, kLongest), kLongest).bodies.size(), 1u);
  EXPECT_TRUE(Listen(Paced(good.wire, 0, 0, 5, kLongest + 1u), kLongest).bodies.empty());
}

TEST(FrameDecoderTime, WithoutATimeoutAFrameMayTakeForever) {
  const FrameVector good = LoadFrame("sense_data_is_all_dle");
  const Heard heard = Listen(Paced(good.wire, 0, 0xFFFFFFFF, 1, 0x80000000), kNoGapTimeout);
  EXPECT_EQ(heard.bodies, std::vector<Bytes>{*good.body});
}

TEST(FrameDecoderTime, WithoutATimeoutExpireDoesNothing) {
  FrameDecoder decoder(kNoGapTimeout);
  decoder.Push(kDle, 0);
  decoder.Push(kStx, 0);
  decoder.Expire(0xFFFFFFFF);
  EXPECT_TRUE(decoder.frame_open());
  EXPECT_EQ(decoder.counters().timeouts, 0u);
}

TEST(FrameDecoderTime, ExpireClosesAnOpenFrameOnceTheTimeoutHasPassed) {
  for (const Bytes& begun : {Bytes{kDle, kStx}, Bytes{kDle, kStx, 1}, Bytes{kDle, kStx, 1, kDle}}) {
    FrameDecoder decoder(kGapMs);
    decoder.PushBlock(begun.data(), begun.size(), 100, [](const Message&) {});
    decoder.Expire(100 + kGapMs);
    EXPECT_TRUE(decoder.frame_open());
    EXPECT_EQ(decoder.counters().timeouts, 0u);
    decoder.Expire(100 + kGapMs + 1);
    EXPECT_FALSE(decoder.frame_open());
    EXPECT_EQ(decoder.counters().timeouts, 1u);
    decoder.Expire(100 + 10 * kGapMs);
    EXPECT_EQ(decoder.counters().timeouts, 1u) << "one frame, counted once";
  }
}

TEST(FrameDecoderTime, ALoneDleDoesNotWaitBeyondTheTimeout) {
  const FrameVector good = LoadFrame("ping_nonce");
  FrameDecoder decoder(kGapMs);
  decoder.Push(kDle, 0);
  decoder.Push(kStx, kGapMs + 1);  // too late to make a start of it
  EXPECT_FALSE(decoder.frame_open());
  EXPECT_EQ(decoder.counters().ignored_bytes, 2u);

  decoder.Push(kDle, 100);
  decoder.Expire(100 + kGapMs);
  decoder.Push(kStx, 100 + kGapMs);
  EXPECT_TRUE(decoder.frame_open());

  decoder.Expire(1000);
  decoder.Push(kDle, 1000);
  decoder.Expire(1000 + kGapMs + 1);
  EXPECT_EQ(decoder.counters().ignored_bytes, 3u);
  EXPECT_EQ(decoder.counters().timeouts, 1u);
}

TEST(FrameDecoderTime, SilenceOutsideOfFramesCountsNothing) {
  FrameDecoder decoder(kGapMs);
  decoder.Expire(1u << 20);
  decoder.Push(0x55, 1u << 21);
  decoder.Expire(1u << 22);
  EXPECT_EQ(decoder.counters().timeouts, 0u);
  EXPECT_EQ(decoder.counters().ignored_bytes, 1u);
}

// ---- Counters

TEST(DecoderCounters, SumsAndDifferencesTakeEachCounterAlsoAfterItHasWrapped) {
  const DecoderCounters before{1, 2, 3, 4, 5, 6, 7, 8, UINT32_MAX};
  const DecoderCounters now{2, 4, 6, 8, 10, 12, 14, 16, 8};
  const DecoderCounters difference{1, 2, 3, 4, 5, 6, 7, 8, 9};
  EXPECT_EQ(testing::Tie(now - before), testing::Tie(difference));
  DecoderCounters sum = before;
  sum += difference;
  EXPECT_EQ(testing::Tie(sum), testing::Tie(now));
}

// ---- Bounds

TEST(FrameDecoder, TheLongestBodyPassesAndOneByteMoreDoesNot) {
  for (const uint8_t fill : {uint8_t{0x55}, kDle, uint8_t{0}}) {
    Bytes body(2u + kMaxData, fill);
    body[0] = 1;
    body[1] = 0x41;
    EXPECT_EQ(Listen(testing::NaiveEncode(body), kGapMs).bodies, std::vector<Bytes>{body});
    body.push_back(fill);
    const Heard heard = Listen(testing::NaiveEncode(body), kGapMs);
    EXPECT_TRUE(heard.bodies.empty());
    EXPECT_EQ(heard.counters.oversize, 1u);
  }
}

TEST(FrameDecoder, AnEndlessFrameIsGivenUpAtTheLimit) {
  FrameDecoder decoder(kNoGapTimeout);
  decoder.Push(kDle, 0);
  decoder.Push(kStx, 0);
  for (int i = 0; i < 100000; ++i) {
    decoder.Push(0x55, 0);
    ASSERT_EQ(decoder.frame_open(), i < kMaxBody) << i;
  }
  EXPECT_EQ(decoder.counters().oversize, 1u);
  EXPECT_EQ(decoder.counters().ignored_bytes, 100000u - kMaxBody - 1u);
}

}  // namespace
}  // namespace pheromone::protocol
