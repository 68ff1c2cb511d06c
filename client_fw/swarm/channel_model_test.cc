#include "client_fw/swarm/channel_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace pheromone::swarm {
namespace {

constexpr int64_t kMs = 1'000'000;

TEST(ChannelModel, TimesOfTheSpecificationsExample) {
  ChannelTiming timing;
  EXPECT_EQ(1'041'666, timing.byte_ns());
  EXPECT_EQ(6 * kMs + int64_t{2} * 1'041'666, timing.response_window_ns());
  EXPECT_EQ(2 * kMs, timing.slot_ns());
  timing.carrier_detect = false;
  EXPECT_EQ(2 * kMs + 1'041'666, timing.slot_ns());
  const engine::LinkSettings link = timing.Link("radio-a");
  EXPECT_EQ("radio-a", link.name);
  EXPECT_EQ(4, link.slot_ms);
  EXPECT_EQ(9, link.response_window_ms);
}

TEST(ChannelModel, AnAdapterAndAKeyedLineCountInTheWindow) {
  ChannelTiming timing;
  timing.adapter_ns = 16 * kMs;
  EXPECT_EQ(22 * kMs + int64_t{2} * 1'041'666, timing.response_window_ns());
  timing.keyed = true;
  timing.lead_ns = 5 * kMs;
  EXPECT_EQ(25 * kMs + int64_t{2} * 1'041'666, timing.response_window_ns());
  EXPECT_EQ(28, timing.Link("radio-a").response_window_ms);
}

// The specification: 14 + 12 bytes = 27.1 ms on the air, C_1 = 1 / (27.1 + 2 * 2 ms) = 32.2 / s.
TEST(ChannelModel, PeakIsThatOfTheSpecification) {
  EXPECT_NEAR(32.2, ChannelTiming{}.PeakRate(kSenseExchange), 0.05);
}

TEST(ChannelModel, ASingleStationSendsOneExchangeAfterTheOther) {
  // 14 bytes, 2 ms until the server has keyed, 12 bytes, two turnarounds.
  EXPECT_NEAR(1 / (26 * 10 / 9600.0 + 0.002 + 0.004), ChannelTiming{}.IdealRate(kSenseExchange, 1),
              0.001);
}

// Bianchi's own approximation of the optimum, eq. (28): p = 1 / (n sqrt(T_c* / 2)), T_c* in slots;
// its throughput is within a few per cent below the exact maximum, and never above it.
TEST(ChannelModel, BoundIsJustAboveBianchisApproximation) {
  for (const bool carrier_detect : {true, false}) {
    for (const int n : {4, 8, 16}) {
      ChannelTiming timing;
      timing.carrier_detect = carrier_detect;
      const double slot_s = static_cast<double>(timing.slot_ns()) / 1e9;
      const double exchange_s = 26 * 10 / 9600.0 + 0.006;
      const double collision_s =
          0.002 + 14 * 10 / 9600.0 + static_cast<double>(timing.response_window_ns()) / 1e9;
      const double p = 1 / (n * std::sqrt(collision_s / slot_s / 2));
      const double some = 1 - std::pow(1 - p, n);  // P_tr
      const double alone = n * p * std::pow(1 - p, n - 1) / some;
      const double approximate =
          some * alone /
          ((1 - some) * slot_s + some * alone * exchange_s + some * (1 - alone) * collision_s);
      const double bound = timing.IdealRate(kSenseExchange, n);
      EXPECT_GE(bound, approximate * 0.9999) << n;
      EXPECT_LE(bound, approximate * 1.05) << n;
    }
  }
}

// The chain of slots itself, played: stations that draw in every slot.
TEST(ChannelModel, BoundIsWhatSimulatedSlotsCarryAtTheirBest) {
  constexpr int kStations = 8;
  const ChannelTiming timing;
  const double slot_s = 0.002;
  const double exchange_s = 26 * 10 / 9600.0 + 0.006;
  const double collision_s =
      0.002 + 14 * 10 / 9600.0 + static_cast<double>(timing.response_window_ns()) / 1e9;
  std::mt19937_64 random(1);
  double best = 0;
  for (const double p : {0.01, 0.03, 0.05, 0.07, 0.1, 0.2}) {
    double time_s = 0;
    int exchanges = 0;
    for (int slot = 0; slot < 200'000; ++slot) {
      int sending = 0;
      for (int station = 0; station < kStations; ++station) {
        sending += static_cast<double>(random() >> 11) * 0x1p-53 < p ? 1 : 0;
      }
      exchanges += sending == 1 ? 1 : 0;
      time_s += sending == 0 ? slot_s : sending == 1 ? exchange_s : collision_s;
    }
    best = std::max(best, exchanges / time_s);
  }
  EXPECT_NEAR(best, timing.IdealRate(kSenseExchange, kStations), 0.02 * best);
}

TEST(ChannelModel, MoreStationsSlowerTurnaroundOrNoCarrierCarryLess) {
  ChannelTiming timing;
  const double base = timing.IdealRate(kSenseExchange, 8);
  EXPECT_LT(timing.IdealRate(kSenseExchange, 16), base);
  EXPECT_GT(timing.IdealRate(kSenseExchange, 2), base);
  timing.carrier_detect = false;
  EXPECT_LT(timing.IdealRate(kSenseExchange, 8), base);
  timing.carrier_detect = true;
  timing.turnaround_ns = 20 * kMs;
  EXPECT_LT(timing.IdealRate(kSenseExchange, 8), base / 2);
}

}  // namespace
}  // namespace pheromone::swarm
