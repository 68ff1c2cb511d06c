// Robots that lay trails, and a log that is slow, and then stuck: they drive on by queries. In
// virtual time, with the clients' and the server's own code.
#include <gtest/gtest.h>

#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"
#include "client_fw/swarm/testing/standing_robots.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kMsInNs = 1'000'000;
constexpr int64_t kSlowSyncMs = 300;
constexpr int64_t kSlowFromMs = 10'000;
constexpr int64_t kStuckFromMs = 20'000;
constexpr int64_t kStuckToMs = 23'000;
constexpr int64_t kEndMs = 30'000;

// Changes are synced together, each 300 ms; for 3 s, not at all.
int64_t DurableAt(int64_t read_ns) {
  const int64_t ms = read_ns / kMsInNs;
  if (ms < kSlowFromMs || ms >= kStuckToMs) {
    return read_ns;
  }
  return (ms < kStuckFromMs ? (ms / kSlowSyncMs + 1) * kSlowSyncMs : kStuckToMs) * kMsInNs;
}

struct Outcome {
  uint32_t slow_stops = 0;   // by the fail-safe, in 10 s
  uint32_t stuck_stops = 0;  // in 3 s, and the 7 s after that
  uint32_t answers = 0;      // by which robots steer, while the log is stuck
};

Outcome WithASlowLog(int robots, bool rounds, int seed = 0) {
  ChannelTiming timing;
  SimulationConfig config;
  config.engine = EngineConfigOf(PathExperiment{});
  config.engine.links = {timing.Link("radio-a")};
  config.server.delay_ns = timing.server_delay_ns;
  config.server.durable_at = DurableAt;
  for (int i = 0; i < robots; ++i) {
    RobotConfig robot = StandingRobot(i);
    robot.client.boot_counter = static_cast<uint16_t>(7 + i + 50 * seed);
    robot.client.rounds = rounds;
    robot.client.buffered_link = !rounds;  // as pheromone-robot's
    robot.client.lay_trail = true;
    robot.power_on_ms = int64_t{61} * i + int64_t{13} * seed * (i + 1);
    config.robots.push_back(robot);
  }
  Simulation simulation(config);
  Outcome outcome;
  const auto answers = [&] {
    uint32_t sum = 0;
    for (size_t i = 0; i < simulation.robot_count(); ++i) {
      const client::Counters counters = simulation.robot(i).counters();
      sum += counters.answers - counters.stale_answers;
    }
    return sum;
  };
  simulation.RunTo(kSlowFromMs);
  const uint32_t stops_before = FailSafeStops(simulation);
  simulation.RunTo(kStuckFromMs);
  outcome.slow_stops = FailSafeStops(simulation) - stops_before;
  const uint32_t answers_before = answers();
  simulation.RunTo(kStuckToMs);
  outcome.answers = answers() - answers_before;
  simulation.RunTo(kEndMs);
  outcome.stuck_stops = FailSafeStops(simulation) - stops_before - outcome.slow_stops;
  return outcome;
}

TEST(SlowLog, RobotsThatLayTrailsNeverStopInRounds) {
  for (const int robots : {2, 3, 4, 5}) {
    for (int seed = 0; seed < 3; ++seed) {
      const Outcome outcome = WithASlowLog(robots, true, seed);
      EXPECT_EQ(outcome.slow_stops, 0u) << robots << ", seed " << seed;
      EXPECT_EQ(outcome.stuck_stops, 0u) << robots << ", seed " << seed;
      EXPECT_GT(outcome.answers, static_cast<uint32_t>(robots) * 6) << robots;  // in 3 s
    }
  }
}

// Six robots take the whole channel: they are asked twice as often, or each would have stopped
// about once in these 10 s.
TEST(SlowLog, NorDoSixOrSeven) {
  for (const int robots : {6, 7}) {
    uint32_t slow_stops = 0;
    for (int seed = 0; seed < 5; ++seed) {
      const Outcome outcome = WithASlowLog(robots, true, seed);
      slow_stops += outcome.slow_stops;
      EXPECT_EQ(outcome.stuck_stops, 0u) << robots << ", seed " << seed;
      EXPECT_GT(outcome.answers, static_cast<uint32_t>(robots) * 6) << robots;
    }
    EXPECT_LE(slow_stops, 3u) << robots;  // of 300 s and more
  }
}

TEST(SlowLog, NorWhereTheyContend) {
  for (const int robots : {1, 2}) {
    const Outcome outcome = WithASlowLog(robots, false);
    EXPECT_EQ(outcome.slow_stops, 0u) << robots;
    EXPECT_EQ(outcome.stuck_stops, 0u) << robots;
    EXPECT_GT(outcome.answers, static_cast<uint32_t>(robots) * 6) << robots;
  }
}

// Three use all of it if each change is made in vain at first.
TEST(SlowLog, ThreeThatContendSeldomStop) {
  uint32_t slow_stops = 0;
  for (int seed = 0; seed < 10; ++seed) {
    const Outcome outcome = WithASlowLog(3, false, seed);
    slow_stops += outcome.slow_stops;
    EXPECT_EQ(outcome.stuck_stops, 0u) << "seed " << seed;
    EXPECT_GT(outcome.answers, 3 * 6u) << "seed " << seed;
  }
  EXPECT_LE(slow_stops, 12u);  // of 300 s; 37 if they repeat a change before they ask
}

}  // namespace
}  // namespace pheromone::swarm
