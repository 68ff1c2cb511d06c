#include "client_fw/experiments/trails/experiment.h"

#include <gtest/gtest.h>

#include "client_fw/experiments/trails/report.h"
#include "client_fw/experiments/trails/testing/shipped_bench.h"

namespace pheromone::swarm {
namespace {

// Queueing at N1, both semaphores, and the way home, with one of three channels for two robots.
TEST(TrailsExperimentTest, RobotsMakeRoundTripsWithoutTouching) {
  TrailsExperiment experiment;
  experiment.rules.robots = 4;
  experiment.channels = 3;
  experiment.trips = 5;
  experiment.duration_ms = 600'000;
  const Result<TrailsRun> run = RunTrails(ShippedBench(), experiment, 1);
  ASSERT_TRUE(run.ok()) << run.error();
  EXPECT_EQ(run.value().ledger.trips(), 5u) << ToTable(run.value());
  EXPECT_TRUE(IsSound(run.value())) << ToTable(run.value());
  EXPECT_EQ(run.value().own_deposits, run.value().server.deposits);
  EXPECT_EQ(run.value().own_deposited, run.value().server.deposited);
  EXPECT_GT(run.value().least_gap_m, 0.05);
  EXPECT_LT(run.value().least_gap_m, 0.3);  // they did queue
}

TEST(TrailsExperimentTest, WhatCannotBeRunIsNamed) {
  TrailsExperiment experiment;
  experiment.rules.robots = 20;
  EXPECT_NE(WhatIsWrong(ShippedBench(), experiment).find("20 robots, but the nest of"),
            std::string::npos);
  experiment.rules.robots = 2;
  experiment.channels = 3;
  EXPECT_EQ(WhatIsWrong(ShippedBench(), experiment),
            "3 channels for 2 robots, expected at most one for each");
  experiment.channels = 0;
  EXPECT_EQ(WhatIsWrong(ShippedBench(), experiment), "");
}

}  // namespace
}  // namespace pheromone::swarm
