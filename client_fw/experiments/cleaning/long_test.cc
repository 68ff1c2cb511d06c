// Larger cleaning swarms than the gate has time for.
#include <gtest/gtest.h>

#include <algorithm>

#include "client_fw/experiments/cleaning/experiment.h"
#include "client_fw/experiments/cleaning/model.h"
#include "client_fw/experiments/cleaning/sweep.h"

namespace pheromone::swarm {
namespace {

CleaningExperiment ForMany() {
  CleaningExperiment base;
  base.timing.baud = 57'600;
  base.period_ms = 100;
  base.slots = 2;
  return base;
}

constexpr int kCycles = 10;

// What the decision alone comes to in so many runs, by its cycle. Two robots that see the same
// oldest zone both go there, since a claim is made on arrival; the second one goes on from there,
// and the zone that it has passed over waits for the next robot that comes by, a cycle later. The
// paper's rule allows it again and again, so that only how often it happens sets a bound.
double MostOfTheDecisionAlone(const CleaningExperiment& size) {
  constexpr uint64_t kRuns = 1000;
  double most = 0;
  for (uint64_t seed = 1; seed <= kRuns; ++seed) {
    most = std::max(most, ModelWorstGap(size.grid, size.robots, kCycles, seed));
  }
  return most;
}

TEST(CleaningLongTest, NoZoneOfAnySizeIsForgottenAndNobodyMeets) {
  for (const CleaningExperiment& size : CleaningSizes(ForMany())) {
    const double most_cycles = MostOfTheDecisionAlone(size);
    const CleaningSeries series = RunSeries(size, kCycles, 2);
    for (const CleaningRun& run : series.runs) {
      EXPECT_TRUE(run.is_safe());
      const CleaningSummary summary = Summarise(series.experiment, run);
      EXPECT_LT(summary.worst_gap_s, most_cycles * summary.cycle_s);
      // Asking takes more time than driving and cleaning on large floors (README.md).
      EXPECT_LT(summary.cycle_s, 2.5 * size.IdealCycleSeconds());
    }
  }
}

TEST(CleaningLongTest, ATenthOfAllFramesMayBeLost) {
  CleaningExperiment experiment = CleaningSizes(ForMany())[2];
  experiment.frame_loss = 0.1;
  experiment.duration_ms = 900'000;
  EXPECT_TRUE(RunCleaning(experiment, 1).is_safe());
}

TEST(CleaningLongTest, TwelveZonesStayBelowTheThresholdFromManyStarts) {
  CleaningExperiment experiment;
  experiment.duration_ms = 3'600'000;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const CleaningRun run = RunCleaning(experiment, seed);
    EXPECT_TRUE(run.is_safe()) << seed;
    EXPECT_LT(Summarise(experiment, run).highest_percent, experiment.soil.threshold_percent)
        << seed;
  }
}

}  // namespace
}  // namespace pheromone::swarm
