// The formulas of timing.h against a conversation that is followed from one UART to the other.
#include "server/robots/radio/timing.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

#include "server/robots/radio/testing/air.h"

namespace pheromone::radio {
namespace {

using namespace std::chrono_literals;

std::vector<Timing> Kinds() {
  std::vector<Timing> all;
  for (const int64_t baud : {1'200, 9'600, 19'200, 38'400, 57'600, 115'200}) {
    for (const Duration turnaround : {0ms, 1ms, 2ms, 5ms, 10ms, 12ms, 20ms, 60ms}) {
      for (const Duration adapter : {0ms, 1ms, 16ms}) {
        for (const Duration processing : {0ms, 2ms, 20ms}) {
          Timing timing{.byte = ByteTime(baud),
                        .turnaround = turnaround,
                        .adapter = adapter,
                        .processing = processing};
          all.push_back(timing);
          timing.keyed = true;
          for (const Duration lead : {0ms, 2ms, 25ms}) {
            timing.lead = lead;
            timing.tail = 3ms;
            all.push_back(timing);
          }
        }
      }
    }
  }
  return all;
}

// An answer that the server begins at `begin`, seen from the robot: its last byte left its UART at
// 0.
struct Exchange {
  Timing timing;

  /// When the server has read the request, at best and at worst.
  Time ReadEarly() const { return timing.turnaround; }
  Time ReadLate() const { return timing.turnaround + timing.adapter; }
  /// When the first bit is on the air.
  Time OnAir(Time begin) const { return begin + (timing.keyed ? timing.lead : timing.turnaround); }
  /// When the robot has the first byte.
  Time FirstByte(Time begin) const { return OnAir(begin) + timing.byte; }
  /// When the robot's modem receives again: a turnaround after the last bit left it.
  Time Turned() const { return timing.turnaround + timing.turnaround; }
};

TEST(Timing, AByteHasTenBits) {
  EXPECT_EQ(ByteTime(9'600), 1'041'666ns);
  EXPECT_EQ(ByteTime(115'200), 86'805ns);
}

TEST(Timing, TheWindowOfATransparentModemHasBothTurnarounds) {
  const Timing timing{.byte = 1ms, .turnaround = 12ms, .adapter = 16ms, .processing = 3ms};
  EXPECT_EQ(timing.ResponseWindow(), 12ms + 16ms + 3ms + 12ms + 2ms);
  EXPECT_EQ(timing.Transit(), 12ms);
}

TEST(Timing, TheWindowOfAKeyedModemHasTheLeadInPlaceOfItsTurnaround) {
  Timing timing{.byte = 1ms, .turnaround = 12ms, .keyed = true, .lead = 25ms, .processing = 3ms};
  EXPECT_EQ(timing.ResponseWindow(), 12ms + 3ms + 25ms + 2ms);
  EXPECT_EQ(timing.Transit(), 0ms) << "its bytes are on the air at once";
  timing.lead = 0ms;
  timing.processing = 20ms;
  EXPECT_EQ(timing.ResponseWindow(), 12ms + 20ms + 2ms);
}

TEST(Timing, TheEarliestAnswerFindsTheRobotsModemTurnedRound) {
  for (const Timing& timing : Kinds()) {
    const Exchange exchange{timing};
    const Time begin = exchange.ReadEarly() + timing.EarliestAnswer();
    ASSERT_GE(exchange.OnAir(begin), exchange.Turned());
    ASSERT_LE(timing.EarliestAnswer(), timing.byte + timing.turnaround) << "and no later";
  }
}

TEST(Timing, TheLatestAnswerReachesTheRobotAtTheEndOfItsWindow) {
  for (const Timing& timing : Kinds()) {
    const Exchange exchange{timing};
    for (const Duration window : {timing.ResponseWindow(), timing.ResponseWindow() + 7ms}) {
      const Time begin = exchange.ReadLate() + timing.LatestAnswer(window);
      ASSERT_EQ(exchange.FirstByte(begin), window);
    }
  }
}

// T_t = 12 ms and 16 ms of USB latency; 38 400 baud and more: nothing was answered.
TEST(Timing, EveryModemAtEveryRateLeavesTheServerTimeToAnswer) {
  for (const Timing& timing : Kinds()) {
    const Duration announced =
        std::chrono::ceil<std::chrono::milliseconds>(timing.ResponseWindow());
    const Duration latest = timing.LatestAnswer(announced);
    ASSERT_GE(latest, timing.EarliestAnswer())
        << "keyed " << timing.keyed << ", T_t " << timing.turnaround.count() << " ns, lead "
        << timing.lead.count() << " ns, processing " << timing.processing.count() << " ns";
    ASSERT_GE(latest, timing.processing);
  }
}

TEST(Timing, TheIdleTimeIsLongerThanTheSilenceBeforeAnAnswer) {
  for (const Timing& timing : Kinds()) {
    // The server has read the end of a frame; the next one begins a turnaround after that at most,
    // and the adapter holds its first byte back.
    ASSERT_GT(timing.Idle(), timing.turnaround + timing.byte + timing.adapter);
  }
}

}  // namespace
}  // namespace pheromone::radio
