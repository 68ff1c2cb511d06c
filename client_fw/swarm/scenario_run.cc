#include "client_fw/swarm/scenario_run.h"

#include <cmath>
#include <random>

#include "client_fw/swarm/simulation.h"

namespace pheromone::swarm {
namespace {

// From -1 to 1, the same on every machine.
double Uniform(std::mt19937_64* random) {
  return static_cast<double>((*random)() >> 11) * 0x1p-52 - 1;
}

SimulationConfig SetUp(const Scenario& scenario) {
  std::mt19937_64 random(scenario.seed);
  SimulationConfig config;
  config.engine = scenario.engine;
  config.radio.baud = scenario.timing.baud;
  config.radio.turnaround_ns = scenario.timing.turnaround_ns;
  config.radio.carrier_detect = scenario.timing.carrier_detect;
  config.radio.block_loss = scenario.loss;
  config.radio.bit_error = scenario.bit_error;
  config.radio.seed = random();
  config.server.delay_ns = scenario.timing.server_delay_ns;
  config.server.response_window_ns = scenario.timing.response_window_ns();
  config.channels = static_cast<size_t>(scenario.channels);
  config.hidden_pairs = scenario.hidden_pairs;
  for (const RobotGroup& group : scenario.groups) {
    for (int i = 0; i < group.count; ++i) {
      sim::SimulatedRobotConfig robot;
      robot.client = group.client;
      robot.client.id = static_cast<uint8_t>(config.robots.size() + 1);
      robot.client.boot_counter = static_cast<uint16_t>(random());
      robot.start = group.starts[static_cast<size_t>(i) % group.starts.size()];
      robot.start.x_m += group.spread_m * Uniform(&random);
      robot.start.y_m += group.spread_m * Uniform(&random);
      config.robots.push_back(robot);
    }
  }
  return config;
}

bool OffLimits(const field::FieldConfig& field, const sim::PlanePose& pose) {
  const field::PointUm at{std::llround(pose.x_m * 1e6), std::llround(pose.y_m * 1e6)};
  return !field.map.Contains(at) ||
         (field.obstacles && field.obstacles->Blocked(field.map.NearestNode(at)));
}

}  // namespace

ScenarioResult RunScenario(const Scenario& scenario, const std::function<void(int64_t ms)>& show) {
  Simulation simulation(SetUp(scenario));
  const field::FieldConfig& field = scenario.engine.field;
  const field::Path path =
      field.paths.empty() ? field::Path{.points = {{0, 0}}} : field.paths.front();
  ScenarioResult result;
  result.robots.resize(simulation.robot_count());
  std::vector<client::Counters> before(simulation.robot_count());
  for (int64_t ms = 0; ms <= scenario.duration_ms; ++ms) {
    simulation.RunTo(ms);
    for (size_t i = 0; i < simulation.robot_count(); ++i) {
      const client::Conversation& conversation = simulation.robot(i).conversation();
      if (conversation.counters().answers != before[i].answers) {
        result.exchanges.push_back({ms, i, conversation.counters().requests - before[i].requests,
                                    conversation.p_left(), conversation.p_right()});
        before[i] = conversation.counters();
      }
    }
    if (ms % scenario.sample_ms == 0) {
      for (size_t i = 0; i < simulation.robot_count(); ++i) {
        RobotResult& robot = result.robots[i];
        robot.track.push_back(Observe(simulation.robot(i), path, ms));
        robot.off_limits_samples += OffLimits(field, robot.track.back().pose) ? 1 : 0;
      }
      if (show) {
        show(ms);
      }
    }
  }
  for (size_t i = 0; i < simulation.robot_count(); ++i) {
    RobotResult& robot = result.robots[i];
    robot.counters = simulation.robot(i).conversation().counters();
    if (!field.paths.empty()) {
      robot.progress_m = Progress(robot.track, path);
      robot.mean_error_m = MeanDistance(robot.track, 0);
    }
  }
  for (size_t i = 0; i < simulation.channel_count(); ++i) {
    result.channels.push_back({simulation.medium(i).counters(), simulation.medium(i).Utilisation(),
                               simulation.server(i).late_answers()});
  }
  result.state_hash = simulation.state_hash();
  return result;
}

}  // namespace pheromone::swarm
