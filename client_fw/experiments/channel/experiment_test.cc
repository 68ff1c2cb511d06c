// What must hold for any client's medium access, and the limits that the project has set itself.
#include "client_fw/experiments/channel/experiment.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "client_fw/experiments/channel/report.h"

namespace pheromone::swarm {
namespace {

ChannelSummary Row(const ChannelExperiment& experiment, int seeds = 3) {
  std::vector<ChannelRun> runs;
  for (int seed = 1; seed <= seeds; ++seed) {
    runs.push_back(MeasureChannel(experiment, static_cast<uint64_t>(seed)));
  }
  return Summarise(experiment, runs);
}

TEST(ChannelExperiment, OneRobotIsAnsweredEveryTime) {
  const ChannelSummary row = Row({.robots = 1, .duration_ms = 20'000});
  EXPECT_EQ(1, row.delivered);
  EXPECT_EQ(1, row.worst_delivered);
  EXPECT_NEAR(5, row.goodput, 0.06);
  EXPECT_EQ(0, row.fail_safe_stops);
  // 27.1 ms on the air, 4 ms of turnarounds, 2 ms of the server's; a robot that is alone may still
  // begin a few milliseconds after the tick.
  EXPECT_GE(row.p50_ms, 33);
  EXPECT_LE(row.p99_ms, 50);
}

TEST(ChannelExperiment, NoRobotGetsMoreThanTheChannelCanCarry) {
  for (const bool carrier_detect : {true, false}) {
    ChannelExperiment experiment{.robots = 1, .period_ms = 0, .duration_ms = 10'000};
    experiment.timing.carrier_detect = carrier_detect;
    const ChannelSummary row = Row(experiment, 1);
    EXPECT_LE(row.goodput, row.ideal);
    EXPECT_LT(row.ideal, row.peak);
  }
}

TEST(ChannelExperiment, SameSeedSameFigures) {
  const ChannelExperiment experiment{.robots = 4, .duration_ms = 5'000};
  EXPECT_EQ(MeasureChannel(experiment, 1).hash, MeasureChannel(experiment, 1).hash);
  EXPECT_NE(MeasureChannel(experiment, 1).hash, MeasureChannel(experiment, 2).hash);
}

TEST(ChannelExperiment, SummaryCountsWhatTheRunsDid) {
  ChannelRun first;
  first.robots = {{100, 90, 95, 700, 1}, {100, 100, 105, 300, 0}};
  first.latencies_ms = {30, 40};
  first.goodput = 20;
  ChannelRun second;
  second.robots = {{100, 80, 60, 900, 2}, {100, 90, 140, 500, 0}};
  second.latencies_ms = {50};
  second.goodput = 10;
  const ChannelSummary row = Summarise({.robots = 2}, {first, second});
  EXPECT_EQ(2, row.seeds);
  EXPECT_DOUBLE_EQ((0.95 + 0.85) / 2, row.delivered);
  EXPECT_DOUBLE_EQ(0.85, row.worst_delivered);
  EXPECT_DOUBLE_EQ(0.8, row.worst_robot_delivered);
  EXPECT_DOUBLE_EQ(0.6, row.worst_robot_share);  // 60 of a mean of 100
  EXPECT_DOUBLE_EQ(15, row.goodput);
  EXPECT_DOUBLE_EQ(10, row.worst_goodput);
  EXPECT_EQ(40, row.p50_ms);
  EXPECT_EQ(50, row.p99_ms);
  EXPECT_EQ(900, row.longest_gap_ms);
  EXPECT_EQ(3, row.fail_safe_stops);
  EXPECT_DOUBLE_EQ(10, row.ideal);  // no more than is asked for
}

TEST(ChannelExperiment, ReportsHaveALineForEachRow) {
  const ChannelSummary row = Row({.robots = 1, .duration_ms = 1'000}, 1);
  const std::string csv = ToCsv({row, row});
  EXPECT_EQ(3, std::count(csv.begin(), csv.end(), '\n'));
  const auto commas = [](const std::string& line) {
    return std::count(line.begin(), line.end(), ',');
  };
  const size_t head_end = csv.find('\n');
  EXPECT_EQ(commas(csv.substr(0, head_end)),
            commas(csv.substr(head_end + 1, csv.find('\n', head_end + 1) - head_end - 1)));
  ChannelSummary sixteen = row;
  sixteen.experiment.robots = 16;
  const std::string gaps = GapsToCsv({row, sixteen});
  EXPECT_EQ(1 + 61, std::count(gaps.begin(), gaps.end(), '\n'));
}

}  // namespace
}  // namespace pheromone::swarm
