#include "client_fw/swarm/scenario_run.h"

#include <gtest/gtest.h>

#include <string>

#include "client_fw/swarm/scenario_report.h"

namespace pheromone::swarm {
namespace {

Scenario Example(const std::string& name) {
  Result<Scenario> scenario =
      LoadScenario(PHEROMONE_SOURCE_DIR "/client_fw/swarm/examples/" + name + ".toml");
  EXPECT_TRUE(scenario.ok());
  return scenario.value();
}

std::string Everything(const Scenario& scenario) {
  const ScenarioResult result = RunScenario(scenario, {});
  return Summarise(scenario, result) + TracksToCsv(result) + ExchangesToCsv(result) +
         DrawScenario(scenario, result);
}

TEST(ScenarioRun, RobotsOnACircuitGoRoundIt) {
  const Scenario scenario = Example("two-on-a-circuit");
  const ScenarioResult result = RunScenario(scenario, {});
  ASSERT_EQ(2u, result.robots.size());
  for (const RobotResult& robot : result.robots) {
    EXPECT_GT(robot.progress_m, 0.8 * 0.3 * 60);
    EXPECT_LT(robot.mean_error_m, 0.1);
    EXPECT_EQ(301u, robot.track.size());
    EXPECT_EQ(0u, robot.counters.fail_safe_stops);
    EXPECT_EQ(0, robot.off_limits_samples);
  }
  // 14 + 12 bytes five times a second for each of two robots.
  ASSERT_EQ(1u, result.channels.size());
  EXPECT_NEAR(2 * 5 * 26 * 10 / 9600.0, result.channels[0].utilisation, 0.03);
}

TEST(ScenarioRun, EveryAnswerIsAnExchange) {
  Scenario scenario = Example("trail-in-a-room");
  scenario.duration_ms = 10'000;
  const ScenarioResult result = RunScenario(scenario, {});
  uint64_t answers = 0;
  uint64_t requests = 0;
  for (const RobotResult& robot : result.robots) {
    answers += robot.counters.answers;
    requests += robot.counters.requests;
  }
  uint64_t requests_answered = 0;
  int64_t last_ms = 0;
  for (const Exchange& exchange : result.exchanges) {
    EXPECT_GE(exchange.time_ms, last_ms);
    last_ms = exchange.time_ms;
    requests_answered += exchange.requests;
  }
  EXPECT_EQ(answers, result.exchanges.size());
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

TEST(ScenarioRun, RobotsOnTwoChannelsDoNotDisturbEachOther) {
  Scenario scenario = Example("two-on-a-circuit");
  scenario.duration_ms = 10'000;
  scenario.channels = 2;
  scenario.engine.links.push_back(scenario.timing.Link("radio-2"));
  const ScenarioResult result = RunScenario(scenario, {});
  ASSERT_EQ(2u, result.channels.size());
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(0u, result.channels[i].radio.collided_blocks);
    EXPECT_EQ(0u, result.robots[i].counters.heard);
    EXPECT_EQ(0u, result.robots[i].counters.timeouts);
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
