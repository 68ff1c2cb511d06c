#include "client_fw/experiments/sweep/experiment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace pheromone::swarm {
namespace {

// Everything that a sweep may turn, in one order.
std::vector<double> KnobsOf(const FollowConditions& c) {
  return {c.cell_m,
          c.core_m,
          c.sigma_m,
          static_cast<double>(c.steering.speed_mm_s),
          static_cast<double>(c.period_ms),
          c.latency_ms,
          c.frame_loss,
          c.odometry_drift,
          static_cast<double>(c.steering.gain_8),
          static_cast<double>(c.duration_ms),
          c.offset_m,
          c.heading_error_deg};
}

TEST(Sweeps, EachTurnsOneKnobAndNoTwoTheSame) {
  std::set<size_t> turned;
  for (const Sweep& sweep : Sweeps()) {
    FollowConditions odd;  // away from every value that a sweep sets
    odd.cell_m = odd.core_m = odd.sigma_m = odd.latency_ms = odd.frame_loss = 0.7777;
    odd.odometry_drift = 0.7777;
    odd.steering.speed_mm_s = 777;
    odd.period_ms = 777;
    const std::vector<double> before = KnobsOf(odd);
    std::set<size_t> changed;
    for (const double value : sweep.values) {
      const std::vector<double> after = KnobsOf(sweep.at(odd, value));
      for (size_t i = 0; i < before.size(); ++i) {
        if (after[i] != before[i]) {
          changed.insert(i);
        }
      }
    }
    EXPECT_EQ(changed.size(), 1u) << sweep.name;
    EXPECT_TRUE(turned.insert(*changed.begin()).second) << sweep.name;
    EXPECT_TRUE(std::is_sorted(sweep.values.begin(), sweep.values.end())) << sweep.name;
  }
  EXPECT_EQ(turned.size(), 8u);
}

TEST(Sweeps, TheDefaultConditionsAreAmongTheValues) {
  for (const Sweep& sweep : Sweeps()) {
    const std::vector<double> usual = KnobsOf({});
    const bool found = std::any_of(sweep.values.begin(), sweep.values.end(), [&](double value) {
      return KnobsOf(sweep.at({}, value)) == usual;
    });
    EXPECT_TRUE(found) << sweep.name;
  }
}

TEST(Sweeps, EveryValueWithEveryLawIsALine) {
  Sweep sweep = Sweeps().back();
  sweep.values.resize(2);
  int shown = 0;
  const std::vector<Contender> contenders = ContendersOf(TunedDifferential(), TunedFuzzy());
  const std::vector<SweepPoint> points =
      RunSweep(sweep, contenders, Curve::kCircle, 1, [&] { ++shown; });
  EXPECT_EQ(points.size(), 8u);
  EXPECT_EQ(shown, 8);
  const std::string csv = ToCsv(points);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 9);
}

}  // namespace
}  // namespace pheromone::swarm
