// The limits that the project has set itself for a channel of 9600 baud with a turnaround and a
// server delay of 2 ms each, over ten seeds: client_fw/README.md and results/README.md tell them.
#include <gtest/gtest.h>

#include "client_fw/swarm/channel_experiment.h"

namespace pheromone::swarm {
namespace {

ChannelSummary TenSeeds(const ChannelExperiment& experiment) {
  std::vector<ChannelRun> runs;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    runs.push_back(Contend(experiment, seed));
  }
  return Summarise(experiment, runs);
}

ChannelExperiment Robots(int robots, bool carrier_detect) {
  ChannelExperiment experiment;
  experiment.robots = robots;
  experiment.timing.carrier_detect = carrier_detect;
  return experiment;
}

class ChannelLimits : public testing::TestWithParam<bool> {};

TEST_P(ChannelLimits, OneRobotAskingContinuouslyGetsNineTenthsOfThePeak) {
  ChannelExperiment experiment = Robots(1, GetParam());
  experiment.period_ms = 0;
  const ChannelSummary row = TenSeeds(experiment);
  EXPECT_GE(row.goodput, 0.9 * row.peak);
}

TEST_P(ChannelLimits, FourRobotsAreAnsweredInTime) {
  const ChannelSummary row = TenSeeds(Robots(4, GetParam()));
  EXPECT_GE(row.delivered, GetParam() ? 0.99 : 0.97);
  EXPECT_GE(row.worst_delivered, GetParam() ? 0.98 : 0.90);
}

TEST_P(ChannelLimits, EightRobotsShareWhatTheChannelCarries) {
  const ChannelSummary row = TenSeeds(Robots(8, GetParam()));
  EXPECT_GE(row.goodput, (GetParam() ? 0.6 : 0.5) * row.peak);
  EXPECT_GE(row.worst_robot_share, 0.5);
  EXPECT_LE(row.longest_gap_ms, 2'000);
}

TEST_P(ChannelLimits, AHiddenPairAmongFourIsAnsweredToo) {
  ChannelExperiment experiment = Robots(4, GetParam());
  experiment.hidden_pair = true;
  EXPECT_GE(TenSeeds(experiment).worst_robot_delivered, 0.5);
}

// Nobody is shut out for good, even by robots that leave no pause.
TEST_P(ChannelLimits, FourRobotsAskingContinuouslyAllGetThrough) {
  ChannelExperiment experiment = Robots(4, GetParam());
  experiment.period_ms = 0;
  const ChannelSummary row = TenSeeds(experiment);
  EXPECT_GE(row.worst_robot_share, 0.25);
  EXPECT_LE(row.longest_gap_ms, 10'000);
}

// Who leaves no pause hears nobody; the other must find a moment nevertheless.
TEST_P(ChannelLimits, TwoRobotsAskingContinuouslyFindEachOther) {
  ChannelExperiment experiment = Robots(2, GetParam());
  experiment.period_ms = 0;
  const ChannelSummary row = TenSeeds(experiment);
  EXPECT_GE(row.worst_robot_share, 0.05);
  EXPECT_LE(row.longest_gap_ms, 50'000);
}

INSTANTIATE_TEST_SUITE_P(CarrierDetect, ChannelLimits, testing::Bool());

}  // namespace
}  // namespace pheromone::swarm
