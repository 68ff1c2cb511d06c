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

// Nothing is lost on a good channel, so every tag is right, and every robot has a session.
TEST(ChannelExperiment, SignedRobotsAreAnsweredAsOthersAre) {
  for (const Access access : {Access::kContention, Access::kRounds}) {
    ChannelExperiment experiment{.robots = 4, .access = access, .duration_ms = 20'000};
    const ChannelRun plain = MeasureChannel(experiment, 1);
    EXPECT_EQ(0u, plain.refused);
    experiment.is_signed = true;
    const ChannelRun run = MeasureChannel(experiment, 1);
    EXPECT_EQ(0u, run.refused);
    EXPECT_NEAR(20, run.goodput, 0.6);
    if (access == Access::kContention) {
      EXPECT_NEAR(1.38, run.utilisation / plain.utilisation, 0.05);  // 36 bytes instead of 26
    }
    EXPECT_NE(run.hash, plain.hash);
  }
}

// Whose second HELLO was not answered may have a turn already, and say the first one in it.
TEST(ChannelExperiment, AFirstHelloInATurnIsAnsweredWithTheRound) {
  for (const uint64_t seed : {5u, 7u}) {  // where that happens
    ChannelExperiment experiment{
        .robots = 16, .access = Access::kRounds, .is_signed = true, .duration_ms = 2'000};
    const ChannelRun run = MeasureChannel(experiment, seed);
    EXPECT_GT(run.time_to_order_ms, 0) << seed;
    EXPECT_LT(run.time_to_order_ms, 8'000) << seed;
  }
}

// A request and its answer take 37.5 ms on the air instead of 27.1, and 6 ms besides.
TEST(ChannelExperiment, ASignedChannelCarriesLess) {
  ChannelExperiment experiment{.robots = 1, .period_ms = 0, .duration_ms = 10'000};
  experiment.is_signed = true;
  const ChannelSummary row = Row(experiment, 1);
  EXPECT_NEAR(row.ideal, 1 / 0.0435, 0.1);
  EXPECT_LE(row.goodput, row.ideal);
  EXPECT_GE(row.goodput, 0.9 * row.ideal);
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
