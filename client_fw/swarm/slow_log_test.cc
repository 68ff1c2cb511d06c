// Robots that lay trails, and a log that is slow, and then stuck: they drive on by queries. In
// virtual time, with the clients' and the server's own code.
#include <gtest/gtest.h>

#include <deque>
#include <utility>

#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"
#include "client_fw/swarm/testing/adapter_robot.h"
#include "client_fw/swarm/testing/standing_robots.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kMsInNs = 1'000'000;
constexpr int64_t kSlowSyncMs = 300;
constexpr int64_t kSlowFromMs = 10'000;
constexpr int64_t kStuckFromMs = 20'000;
constexpr int64_t kStuckToMs = 23'000;
constexpr int64_t kEndMs = 30'000;

// Each sync takes 300 ms, and for 3 s none ends. What is written meanwhile waits for the next one.
class Disk {
 public:
  /// When a change that is written now is on disk. To be asked in the order of time.
  int64_t DurableAt(int64_t now_ns) {
    const int64_t ms = now_ns / kMsInNs;
    if (ms < kSlowFromMs || ms >= kStuckToMs) {
      return now_ns;
    }
    if (ms >= kStuckFromMs) {
      return kStuckToMs * kMsInNs;
    }
    if (next_is_due_ && ms >= until_ms_) {
      next_is_due_ = false;
      until_ms_ += kSlowSyncMs;
    }
    if (ms >= until_ms_) {
      until_ms_ = ms + kSlowSyncMs;
      return until_ms_ * kMsInNs;
    }
    next_is_due_ = true;
    return (until_ms_ + kSlowSyncMs) * kMsInNs;
  }

 private:
  int64_t until_ms_ = 0;      // of the sync in progress
  bool next_is_due_ = false;  // something waits for the next one
};

struct Outcome {
  uint32_t slow_stops = 0;   // by the fail-safe, in 10 s
  uint32_t stuck_stops = 0;  // in 3 s, and the 7 s after that
  uint32_t answers = 0;      // by which robots steer, while the log is stuck
};

enum class Robots : uint8_t {
  kInRounds,
  kContend,
  kBehindAdapters,  // contend, and so is the server
};

Outcome WithASlowLog(int robots, Robots kind, int seed = 0, double byte_error = 0) {
  ChannelTiming timing;
  const bool adapters = kind == Robots::kBehindAdapters;
  timing.adapter_ns = adapters ? kHoldsBackMs * kMsInNs : 0;
  Disk disk;
  SimulationConfig config;
  config.engine = EngineConfigOf(PathExperiment{});
  config.engine.links = {timing.Link("radio-a")};
  config.radio.byte_error = byte_error;
  config.server.delay_ns = timing.server_delay_ns;
  config.server.adapter_ns = timing.adapter_ns;
  config.server.durable_at = [&disk](int64_t now_ns) { return disk.DurableAt(now_ns); };
  config.robot.power_on_ms = 2 * kEndMs;  // of the simulation's own, if there are no others
  std::deque<AdapterRobot> behind_adapters;
  for (int i = 0; i < robots && !adapters; ++i) {
    RobotConfig robot = StandingRobot(i);
    robot.client.boot_counter = static_cast<uint16_t>(7 + i + 50 * seed);
    robot.client.rounds = kind == Robots::kInRounds;
    robot.client.buffered_link = kind == Robots::kContend;  // as pheromone-robot's
    robot.client.lay_trail = true;
    robot.power_on_ms = int64_t{61} * i + int64_t{13} * seed * (i + 1);
    config.robots.push_back(robot);
  }
  config.add_listener = [&](size_t, sim::RadioMedium* medium) {
    for (int i = 0; i < robots && adapters; ++i) {
      client::Parameters parameters = AdapterRobotParameters(static_cast<uint8_t>(101 + i));
      parameters.boot_counter = static_cast<uint16_t>(7 + i + 50 * seed);
      behind_adapters.emplace_back(parameters,
                                   (i + seed) % 2 == 0 ? Adapter::kLooks : Adapter::kWaits, medium);
    }
  };
  Simulation simulation(config);
  const auto run_to = [&](int64_t end_ms) {
    while (simulation.now_ms() < end_ms) {
      const int64_t ms = simulation.now_ms() + 1;
      simulation.RunTo(ms);
      for (AdapterRobot& robot : behind_adapters) {
        robot.Step(ms);
      }
    }
  };
  const auto total = [&](auto of) {
    uint32_t all = 0;
    for (size_t i = 0; i < simulation.robot_count(); ++i) {
      all += of(simulation.robot(i).counters());
    }
    for (const AdapterRobot& robot : behind_adapters) {
      all += of(robot.counters());
    }
    return all;
  };
  const auto stops = [](const client::Counters& counters) { return counters.fail_safe_stops; };
  const auto answers = [](const client::Counters& counters) {
    return counters.answers - counters.stale_answers;
  };
  Outcome outcome;
  run_to(kSlowFromMs);
  const uint32_t stops_before = total(stops);
  run_to(kStuckFromMs);
  outcome.slow_stops = total(stops) - stops_before;
  const uint32_t answers_before = total(answers);
  run_to(kStuckToMs);
  outcome.answers = total(answers) - answers_before;
  run_to(kEndMs);
  outcome.stuck_stops = total(stops) - stops_before - outcome.slow_stops;
  return outcome;
}

TEST(SlowLog, RobotsThatLayTrailsNeverStopInRounds) {
  for (const int robots : {2, 3, 4, 5}) {
    for (int seed = 0; seed < 3; ++seed) {
      const Outcome outcome = WithASlowLog(robots, Robots::kInRounds, seed);
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
      const Outcome outcome = WithASlowLog(robots, Robots::kInRounds, seed);
      slow_stops += outcome.slow_stops;
      EXPECT_EQ(outcome.stuck_stops, 0u) << robots << ", seed " << seed;
      EXPECT_GT(outcome.answers, static_cast<uint32_t>(robots) * 6) << robots;
    }
    EXPECT_LE(slow_stops, 3u) << robots;  // of 300 s and more
  }
}

// Two answers in succession may lack, three are a stop: a change that waits, its late answer, or
// the air. Where each busy was followed by one query, these runs had 108 and 390 stops.
TEST(SlowLog, InBadAirTheyStopMoreSeldom) {
  for (const auto& [robots, most] : {std::pair{4, 40u}, std::pair{6, 310u}}) {
    uint32_t stops = 0;
    for (int seed = 0; seed < 20; ++seed) {
      const Outcome outcome = WithASlowLog(robots, Robots::kInRounds, seed, 0.001);
      stops += outcome.slow_stops + outcome.stuck_stops;
    }
    EXPECT_LE(stops, most) << robots;  // of 400 s
  }
}

TEST(SlowLog, NorWhereTheyContend) {
  for (const int robots : {1, 2}) {
    const Outcome outcome = WithASlowLog(robots, Robots::kContend);
    EXPECT_EQ(outcome.slow_stops, 0u) << robots;
    EXPECT_EQ(outcome.stuck_stops, 0u) << robots;
    EXPECT_GT(outcome.answers, static_cast<uint32_t>(robots) * 6) << robots;
  }
}

TEST(SlowLog, NorBehindAdapters) {
  for (const int robots : {1, 2}) {
    for (int seed = 0; seed < 10; ++seed) {
      const Outcome outcome = WithASlowLog(robots, Robots::kBehindAdapters, seed);
      EXPECT_EQ(outcome.slow_stops, 0u) << robots << ", seed " << seed;
      EXPECT_EQ(outcome.stuck_stops, 0u) << robots << ", seed " << seed;
      EXPECT_GT(outcome.answers, static_cast<uint32_t>(robots) * 6) << robots;
    }
  }
}

// Three use all of it if each change is made in vain at first.
TEST(SlowLog, ThreeThatContendSeldomStop) {
  uint32_t slow_stops = 0;
  for (int seed = 0; seed < 10; ++seed) {
    const Outcome outcome = WithASlowLog(3, Robots::kContend, seed);
    slow_stops += outcome.slow_stops;
    EXPECT_EQ(outcome.stuck_stops, 0u) << "seed " << seed;
    EXPECT_GT(outcome.answers, 3 * 6u) << "seed " << seed;
  }
  EXPECT_LE(slow_stops, 12u);  // of 300 s; 37 if they repeat a change before they ask
}

}  // namespace
}  // namespace pheromone::swarm
