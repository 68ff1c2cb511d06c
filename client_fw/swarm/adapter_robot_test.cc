// A robot behind a USB adapter that holds back what it received for 16 ms, such as
// pheromone-robot's, among robots in rounds: it contends, and is served. In virtual time.
#include "client_fw/swarm/testing/adapter_robot.h"

#include <gtest/gtest.h>

#include <memory>

#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"
#include "client_fw/swarm/testing/standing_robots.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kWarmMs = 10'000;
constexpr int64_t kFiveMinutesMs = 300'000;

struct Served {
  double answers_per_s = 0;
  uint32_t stops = 0;
  uint32_t stops_of_others = 0;
};

Served Serve(int others, Adapter adapter, uint8_t adapter_ms, int64_t servers_adapter_ms) {
  ChannelTiming timing;
  timing.adapter_ns = servers_adapter_ms * 1'000'000;
  SimulationConfig config;
  config.engine = EngineConfigOf(PathExperiment{});
  config.engine.links = {timing.Link("radio-a")};
  config.server.delay_ns = timing.server_delay_ns;
  config.server.adapter_ns = timing.adapter_ns;
  for (int i = 0; i < others; ++i) {
    RobotConfig robot = StandingRobot(i);
    robot.power_on_ms = int64_t{61} * i;
    robot.client.lay_trail = true;
    config.robots.push_back(robot);
  }
  client::Parameters parameters = AdapterRobotParameters(200);
  parameters.adapter_ms = adapter_ms;
  std::unique_ptr<AdapterRobot> robot;
  config.add_listener = [&](size_t, sim::RadioMedium* medium) {
    robot = std::make_unique<AdapterRobot>(parameters, adapter, medium);
  };
  Simulation simulation(config);
  client::Counters before{};
  uint32_t others_before = 0;
  for (int64_t ms = 1; ms <= kWarmMs + kFiveMinutesMs; ++ms) {
    simulation.RunTo(ms);
    robot->Step(ms);
    if (ms == kWarmMs) {
      before = robot->counters();
      others_before = FailSafeStops(simulation);
    }
  }
  const client::Counters after = robot->counters();
  return {(after.answers - before.answers) * 1000.0 / kFiveMinutesMs,
          after.fail_safe_stops - before.fail_safe_stops,
          FailSafeStops(simulation) - others_before};
}

// It asks for five answers per second, as they do.
TEST(AdapterRobot, IsServedAmongThreeInRounds) {
  for (const Adapter adapter : {Adapter::kLooks, Adapter::kWaits}) {
    for (const int64_t servers_adapter_ms : {0, 1, 16}) {
      const Served served = Serve(3, adapter, kHoldsBackMs, servers_adapter_ms);
      EXPECT_GE(served.answers_per_s, 4.9) << servers_adapter_ms;
      EXPECT_EQ(served.stops, 0u) << servers_adapter_ms;
      EXPECT_EQ(served.stops_of_others, 0u) << servers_adapter_ms;
    }
  }
}

// What it misses if it does not wait for its adapter: the server's window does not contain it.
TEST(AdapterRobot, HasToWaitForItsAdapter) {
  EXPECT_LT(Serve(3, Adapter::kLooks, 0, 0).answers_per_s,
            0.8 * Serve(3, Adapter::kLooks, kHoldsBackMs, 0).answers_per_s);
}

}  // namespace
}  // namespace pheromone::swarm
