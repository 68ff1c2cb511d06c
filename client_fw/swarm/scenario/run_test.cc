#include "client_fw/swarm/scenario/run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "client_fw/swarm/scenario/report.h"

namespace pheromone::swarm {
namespace {

Scenario Example(const std::string& name) {
  Result<Scenario> scenario =
      LoadScenario(PHEROMONE_SOURCE_DIR "/client_fw/swarm/examples/" + name + ".toml");
  EXPECT_TRUE(scenario.ok());
  return scenario.value();
}

std::string Everything(const Scenario& scenario) {
  const SwarmRecord record = RunScenario(scenario, {});
  return Summarise(scenario, record) + RobotsToCsv(scenario, record) + TracksToCsv(record) +
         ExchangesToCsv(record) + DrawScenario(scenario, record);
}

TEST(ScenarioRun, RobotsOnACircuitGoRoundIt) {
  const Scenario scenario = Example("two-on-a-circuit");
  const SwarmRecord record = RunScenario(scenario, {});
  ASSERT_EQ(2u, record.robots.size());
  for (const RobotRecord& robot : record.robots) {
    EXPECT_GT(robot.progress_m, 0.8 * 0.3 * 60);
    EXPECT_LT(robot.mean_error_m, 0.1);
    EXPECT_EQ(301u, robot.track.size());
    EXPECT_EQ(0u, robot.counters.fail_safe_stops);
    EXPECT_EQ(0, robot.off_limits_samples);
  }
  // Five times a second a ROUND with two turns, 16 bytes, two requests of 14, and a ROUND with two
  // answers, 22.
  ASSERT_EQ(1u, record.channels.size());
  EXPECT_NEAR(5 * (16 + 2 * 14 + 22) * 10 / 9600.0, record.channels[0].utilisation, 0.03);
}

TEST(ScenarioRun, EveryAnswerIsAnExchange) {
  Scenario scenario = Example("trail-in-a-room");
  scenario.duration_ms = 10'000;
  const SwarmRecord record = RunScenario(scenario, {});
  uint64_t answers = 0;
  uint64_t requests = 0;
  for (const RobotRecord& robot : record.robots) {
    answers += robot.counters.answers;
    requests += robot.counters.requests;
  }
  uint64_t requests_answered = 0;
  int64_t last_ms = 0;
  for (const Exchange& exchange : record.exchanges) {
    EXPECT_GE(exchange.time_ms, last_ms);
    last_ms = exchange.time_ms;
    requests_answered += exchange.requests;
  }
  EXPECT_EQ(answers, record.exchanges.size());
  EXPECT_GT(answers, 100u);
  EXPECT_LE(requests_answered, requests);
  EXPECT_GE(requests_answered, answers);
}

TEST(ScenarioRun, SameSeedSameBytes) {
  Scenario scenario = Example("trail-in-a-room");
  scenario.duration_ms = 5'000;
  const std::string first = Everything(scenario);
  EXPECT_EQ(first, Everything(scenario));
  scenario.seed = 8;
  EXPECT_NE(first, Everything(scenario));
}

TEST(ScenarioRun, PioneersFollowThePathAsIdealDrivesDo) {
  const Scenario scenario = Example("pioneer");
  const SwarmRecord record = RunScenario(scenario, {});
  ASSERT_EQ(3u, record.robots.size());
  for (const RobotRecord& robot : record.robots) {
    EXPECT_GT(robot.progress_m, 0.85 * 0.2 * 40);
    EXPECT_LT(robot.mean_error_m, 0.06);
    EXPECT_EQ(0u, robot.bumps);
    EXPECT_EQ(0u, robot.counters.fail_safe_stops);
  }
}

TEST(ScenarioRun, PioneersDriveTheSameWayForTheSameSeed) {
  Scenario scenario = Example("pioneer");
  scenario.duration_ms = 10'000;
  const std::string first = Everything(scenario);
  EXPECT_EQ(first, Everything(scenario));
  scenario.seed = 2;
  EXPECT_NE(first, Everything(scenario));
}

// The wall of the example covers [5.95, 6.05] x [0.95, 3.55], and robots are discs of 0.25 m.
double ToTheWall(const sim::PlanePose& pose) {
  return std::hypot(pose.x_m - std::clamp(pose.x_m, 5.95, 6.05),
                    pose.y_m - std::clamp(pose.y_m, 0.95, 3.55));
}

TEST(ScenarioRun, EachRobotIsMeasuredAgainstThePathItStartsNearestTo) {
  const SwarmRecord record = RunScenario(Example("obstacles"), {});
  ASSERT_EQ(3u, record.robots.size());
  for (const RobotRecord& robot : record.robots) {
    EXPECT_LT(robot.mean_error_m, 0.1);  // the paths are metres apart
    EXPECT_GT(robot.progress_m, 1);
  }
}

TEST(ScenarioRun, RobotsStopAtObstaclesAndDoNotEnterThem) {
  const Scenario scenario = Example("obstacles");
  const SwarmRecord record = RunScenario(scenario, {});
  ASSERT_EQ(3u, record.robots.size());
  // The wall's face, and that of the squares which the pillar's rim at x = 5.7 reaches into.
  constexpr double kFacesM[] = {5.95, 5.65};
  for (size_t i = 0; i < 2; ++i) {
    const RobotRecord& robot = record.robots[i];
    for (const Sample& sample : robot.track) {
      ASSERT_LT(sample.pose.x_m, kFacesM[i] - 0.25) << "robot " << i + 1;
    }
    EXPECT_GT(robot.track.back().pose.x_m, kFacesM[i] - 0.25 - 0.001) << "robot " << i + 1;
    EXPECT_EQ(1u, robot.bumps);
    EXPECT_EQ(0, robot.off_limits_samples);
  }
  EXPECT_GT(record.robots[2].track.back().pose.x_m, 8);
  EXPECT_EQ(0u, record.robots[2].bumps);
  EXPECT_NE(std::string::npos, Summarise(scenario, record).find("; 1 bumps\n"));
  EXPECT_NE(std::string::npos, RobotsToCsv(scenario, record).find("\n2,core,p3dx-sh,"));
}

TEST(ScenarioRun, ThePictureShowsTheObstacles) {
  Scenario scenario = Example("obstacles");
  scenario.duration_ms = 1'000;
  const std::string with = DrawScenario(scenario, RunScenario(scenario, {}));
  EXPECT_NE(std::string::npos, with.find("obstacles</text>"));
  scenario.engine.field.obstacles = {};
  const std::string without = DrawScenario(scenario, RunScenario(scenario, {}));
  EXPECT_EQ(std::string::npos, without.find("obstacles</text>"));
}

TEST(ScenarioRun, StartsDrawnAtRandomAreClearOfWalls) {
  Scenario scenario = Example("obstacles");
  scenario.duration_ms = 1;
  scenario.sample_ms = 1;
  scenario.groups.resize(1);
  scenario.groups[0].starts = {{5, 2, 0}};
  scenario.groups[0].spread_m = 1.5;
  scenario.groups[0].count = 100;
  const SwarmRecord record = RunScenario(scenario, {});
  int beyond = 0;
  for (const RobotRecord& robot : record.robots) {
    EXPECT_GT(ToTheWall(robot.track.front().pose), 0.25 - 1e-6);
    beyond += robot.track.front().pose.x_m > 6 ? 1 : 0;
  }
  EXPECT_GT(beyond, 0);
}

TEST(ScenarioRun, RobotsOnTwoChannelsDoNotDisturbEachOther) {
  Scenario scenario = Example("two-on-a-circuit");
  scenario.duration_ms = 10'000;
  scenario.channels = 2;
  scenario.engine.links.push_back(scenario.timing.Link("radio-2"));
  const SwarmRecord record = RunScenario(scenario, {});
  ASSERT_EQ(2u, record.channels.size());
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(0u, record.channels[i].radio.collided_blocks);
    EXPECT_EQ(0u, record.robots[i].counters.heard);
    EXPECT_EQ(0u, record.robots[i].counters.timeouts);
  }
}

TEST(ScenarioRun, ProgressIsShownUpToTheEnd) {
  Scenario scenario = Example("two-on-a-circuit");
  scenario.duration_ms = 1'000;
  std::vector<int64_t> shown;
  RunScenario(scenario, [&](int64_t ms) { shown.push_back(ms); });
  EXPECT_EQ((std::vector<int64_t>{0, 200, 400, 600, 800, 1000}), shown);
}

}  // namespace
}  // namespace pheromone::swarm
