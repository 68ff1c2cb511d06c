// Noise, stuck carriers and rubbish that looks like frames: none of them may silence a robot for
// good, while real traffic keeps the right of way.
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <vector>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint32_t kTenSeconds = 10'000;

/// The longest frame at 9600 baud and a gap.
constexpr uint32_t kLongestFrameMs = 146 + 20;
/// That and a random delay in slots of 20 ms, which a robot assumes before HELLO is answered.
constexpr uint32_t kPatienceMs = kLongestFrameMs + 10 * 20;

/// Bytes from a receiver that hears nothing but noise, one a millisecond, which is the rate of 9600
/// baud. While the robot itself sends it is deaf.
using Noise = std::function<uint8_t()>;

Noise RandomNoise(uint32_t seed) {
  return [random = std::mt19937(seed)]() mutable { return static_cast<uint8_t>(random()); };
}

Noise Repeated(std::vector<uint8_t> pattern) {
  return [pattern, at = size_t{0}]() mutable { return pattern[at++ % pattern.size()]; };
}

/// `ms` of noise, in which the server answers if `served`. Returns how many frames the robot sent.
int RunInNoise(uint32_t ms, Noise noise, bool served, Harness* harness) {
  const int before = harness->frames_sent;
  for (uint32_t i = 0; i < ms; ++i) {
    if (!harness->leaving) {
      harness->FeedByte(noise());
    }
    if (served) {
      harness->Serve(1);
    } else {
      harness->Step();
    }
  }
  return harness->frames_sent - before;
}

/// HELLO's back-off is at most 800 ms: this many in ten seconds are not the work of silence.
constexpr int kHellosInTenSeconds = 10;

TEST(NoiseTest, RobotStillSaysHelloInConstantNoise) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Harness harness;
    EXPECT_GE(RunInNoise(kTenSeconds, RandomNoise(seed), false, &harness), kHellosInTenSeconds);
    EXPECT_GE(harness.counters().ignored_noise, 1u);
  }
}

// A receiver without squelch: noise whenever nobody sends.
TEST(NoiseTest, ConstantNoiseBetweenTheFramesTakesNoPeriodAway) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Harness harness;
    harness.GreetAndServe(1500);
    RunInNoise(500, RandomNoise(seed), true, &harness);
    const uint32_t answers = harness.counters().answers;
    RunInNoise(kTenSeconds, RandomNoise(seed), true, &harness);
    EXPECT_GE(harness.counters().answers - answers, kTenSeconds / 200 * 9 / 10) << seed;
    EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  }
}

TEST(NoiseTest, NothingThatLacksAValidFrameSilencesARobot) {
  const std::vector<uint8_t> damaged = {protocol::kDle, protocol::kStx, 1, 2, 3, 4, 5, 6,
                                        protocol::kDle, protocol::kEtx};
  std::vector<uint8_t> endless = {protocol::kDle, protocol::kStx};
  endless.resize(130, 0x55);
  const std::vector<std::vector<uint8_t>> patterns = {
      {0x00},                            // a broken line
      {0xFF},                            // an idle line that is misread
      {protocol::kDle},                  // may always be the beginning of a frame
      {protocol::kDle, 0x55},            // likewise
      {protocol::kDle, protocol::kStx},  // a new frame again and again
      {protocol::kDle, protocol::kStx, protocol::kDle, protocol::kEtx},
      damaged,
      endless,
  };
  for (size_t i = 0; i < patterns.size(); ++i) {
    Harness harness;
    EXPECT_GE(RunInNoise(kTenSeconds, Repeated(patterns[i]), false, &harness), kHellosInTenSeconds)
        << i;
  }
}

// Each byte just before the gap timeout of a frame that never ends.
TEST(NoiseTest, SlowBytesInAFrameHoldTheChannelNoLongerThanTheLongestFrame) {
  Harness harness;
  const std::vector<uint8_t> pattern = {protocol::kDle, protocol::kStx, 0x55};
  for (uint32_t i = 0; i < kTenSeconds / 19; ++i) {
    if (!harness.leaving) {
      harness.FeedByte(pattern[i % 60 < 2 ? i % 60 : 2]);
    }
    harness.Run(19);
  }
  EXPECT_GE(harness.frames_sent, kHellosInTenSeconds);
}

// Their windows would follow one another without a gap.
TEST(NoiseTest, DamagedFramesOpenNoWindowsWhereMostAreDamaged) {
  const std::vector<uint8_t> damaged = {protocol::kDle, protocol::kStx, 1, 2, 3, 4, 5, 6,
                                        protocol::kDle, protocol::kEtx};
  Harness harness;
  harness.hello.response_window_ms = 100;
  harness.GreetAndServe(1500);
  const uint32_t answers = harness.counters().answers;
  for (uint32_t i = 0; i < kTenSeconds / 80; ++i) {
    if (!harness.leaving) {
      for (const uint8_t byte : damaged) {
        harness.FeedByte(byte);
      }
    }
    harness.Serve(80);
  }
  EXPECT_GE(harness.counters().answers - answers, 30u);
  EXPECT_GE(harness.counters().ignored_damage, 1u);
}

TEST(NoiseTest, FrameAfterNoiseHoldsTheChannel) {
  Harness harness;
  harness.GreetAndServe(1500);
  RunInNoise(1000, RandomNoise(1), true, &harness);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.FeedByte(protocol::kDle);
  harness.FeedByte(protocol::kStx);
  const uint32_t began_ms = harness.now_ms;
  while (harness.now_ms < began_ms + 140) {
    harness.FeedByte(0x55);
    harness.Run(10);
    EXPECT_FALSE(harness.leaving);
  }
}

// The rest of a frame whose beginning was missed, here of the longest.
TEST(NoiseTest, BytesWithoutAFrameHoldTheChannelForAsLongAsAFrameMayLast) {
  Harness harness;
  harness.GreetAndServe(1500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Run(harness.began_ms + 195 - harness.now_ms);
  for (uint32_t ms = 0; ms < 140; ++ms) {
    harness.FeedByte(0x55);
    harness.Step();
    ASSERT_FALSE(harness.leaving) << ms;
  }
  EXPECT_EQ(0u, harness.counters().ignored_noise);
}

TEST(NoiseTest, SilenceMakesBytesCountAgain) {
  Harness harness;
  harness.GreetAndServe(1500);
  RunInNoise(1000, RandomNoise(1), true, &harness);
  ASSERT_EQ(1u, harness.counters().ignored_noise);
  harness.Serve(500);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Run(harness.began_ms + 195 - harness.now_ms);
  for (uint32_t ms = 0; ms < 140; ++ms) {
    harness.FeedByte(0x55);
    harness.Step();
    ASSERT_FALSE(harness.leaving) << ms;
  }
}

TEST(StuckCarrierTest, IsIgnoredAfterTwoSecondsUntilItDrops) {
  Harness harness;
  harness.GreetAndServe(1500);
  harness.busy = true;
  EXPECT_FALSE(harness.RunUntilSent(2000));
  EXPECT_EQ(0u, harness.counters().ignored_carriers);
  EXPECT_TRUE(harness.RunUntilSent(kPatienceMs));
  harness.Serve(1000);
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  EXPECT_EQ(1u, harness.counters().ignored_carriers);
  const uint32_t answers = harness.counters().answers;
  harness.Serve(kTenSeconds);
  EXPECT_GE(harness.counters().answers - answers, kTenSeconds / 200 * 9 / 10);
  EXPECT_EQ(1u, harness.counters().ignored_carriers);

  harness.busy = false;
  harness.Serve(500);
  harness.busy = true;  // as good as new
  harness.Run(1);
  EXPECT_FALSE(harness.RunUntilSent(2000));
}

TEST(StuckCarrierTest, RobotThatIsSwitchedOnUnderOneSaysHello) {
  Harness harness;
  harness.busy = true;
  EXPECT_FALSE(harness.RunUntilSent(2000));
  EXPECT_TRUE(harness.RunUntilSent(kPatienceMs));
}

// It need not be the carrier that was there before the pause.
TEST(StuckCarrierTest, PauseOfTheLoopDoesNotCount) {
  Harness harness;
  harness.GreetAndServe(1500);
  harness.busy = true;
  harness.Run(100);
  harness.now_ms += 5000;
  EXPECT_FALSE(harness.RunUntilSent(1500));
}

TEST(StuckCarrierTest, FramesUnderItKeepTheRightOfWay) {
  Harness harness;
  harness.GreetAndServe(1500);
  harness.busy = true;
  harness.Serve(4000);
  ASSERT_TRUE(harness.RunUntilSent());
  harness.Answer(0, 0);
  harness.Run(harness.began_ms + 199 - harness.now_ms);
  harness.FeedEncoded(protocol::SenseRequest{kTestId + 1, 2, false, {}});
  harness.Run(kTestWindowMs);
  EXPECT_FALSE(harness.leaving);
  EXPECT_TRUE(harness.RunUntilSent(kTestIdleMs + 9 * kTestSlotMs + 17));
}

TEST(StuckCarrierTest, WithConstantNoiseRobotStillSendsItsRequests) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Harness harness;
    harness.GreetAndServe(1500);
    harness.busy = true;
    RunInNoise(3000, RandomNoise(seed), true, &harness);
    const uint32_t answers = harness.counters().answers;
    RunInNoise(kTenSeconds, RandomNoise(seed), true, &harness);
    EXPECT_GE(harness.counters().answers - answers, kTenSeconds / 200 * 9 / 10) << seed;
  }
}

// At 1200 baud a frame may last 1.2 s.
TEST(StuckCarrierTest, PatienceGrowsWithTheTimeOfAByte) {
  Parameters parameters = TestParameters();
  parameters.baud = 1200;
  Harness harness(parameters);
  harness.busy = true;
  EXPECT_FALSE(harness.RunUntilSent(3100));
  EXPECT_TRUE(harness.RunUntilSent(1000));
}

}  // namespace
}  // namespace client
}  // namespace pheromone
