// Larger cleaning swarms than the gate has time for.
#include <gtest/gtest.h>

#include "client_fw/experiments/cleaning/experiment.h"
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

TEST(CleaningLongTest, NoZoneOfAnySizeIsForgottenAndNobodyMeets) {
  for (const CleaningExperiment& size : CleaningSizes(ForMany())) {
    const CleaningSeries series = RunSeries(size, 10, 2);
    for (const CleaningRun& run : series.runs) {
      EXPECT_TRUE(run.is_safe());
      EXPECT_LT(Summarise(series.experiment, run).worst_gap_s, 5 * size.IdealCycleSeconds());
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
