#include "client_fw/swarm/scenario/run.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>

#include "client_fw/swarm/collision.h"
#include "client_fw/swarm/simulation.h"

namespace pheromone::swarm {
namespace {

constexpr int kMaxDraws = 1000;

// From -1 to 1, the same on every machine.
double Uniform(std::mt19937_64* random) {
  return static_cast<double>((*random)() >> 11) * 0x1p-52 - 1;
}

// Moved at random to a free position; after many failed attempts, not at all.
sim::PlanePose DrawStart(const RobotGroup& group, int number, const sim::Blocked& blocked,
                         std::mt19937_64* random) {
  const sim::PlanePose given = group.starts[static_cast<size_t>(number) % group.starts.size()];
  for (int i = 0; i < kMaxDraws; ++i) {
    sim::PlanePose start = given;
    start.x_m += group.spread_m * Uniform(random);
    start.y_m += group.spread_m * Uniform(random);
    if (!blocked || !blocked(start)) {
      return start;
    }
  }
  return given;
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
  config.server.adapter_ns = scenario.timing.adapter_ns;
  config.channels = static_cast<size_t>(scenario.channels);
  config.hidden_pairs = scenario.hidden_pairs;
  for (const RobotGroup& group : scenario.groups) {
    const sim::Blocked blocked = BlockedBy(scenario.engine.field, group.radius_m);
    const sim::RangeFinder range = RangeTo(scenario.engine.field);
    for (int i = 0; i < group.count; ++i) {
      RobotConfig robot;
      robot.client = group.client;
      robot.client.id = static_cast<uint8_t>(config.robots.size() + 1);
      robot.client.boot_counter = static_cast<uint16_t>(random());
      robot.start = DrawStart(group, i, blocked, &random);
      robot.drive.blocked = blocked;
      robot.range = range;
      robot.radius_m = group.radius_m;
      robot.pioneer = group.pioneer;
      robot.image = group.image;
      if (!group.image.empty()) {
        // An image's coordinates start where it is switched on; the server knows that pose.
        config.engine.frames.push_back(engine::MakeFrame(
            scenario.engine.links[config.robots.size() % config.channels].name, robot.client.id,
            {std::llround(robot.start.x_m * 1e6), std::llround(robot.start.y_m * 1e6)},
            robot.start.heading_rad * 180 / std::numbers::pi));
      }
      config.robots.push_back(robot);
    }
  }
  return config;
}

// The same robots for a daemon, which may remember robots of earlier runs, and for ports, which may
// delay bytes.
SwarmConfig SetUpLive(const Scenario& scenario, LinkKind links) {
  const SimulationConfig simulated = SetUp(scenario);
  SwarmConfig config = static_cast<const SwarmConfig&>(simulated);  // the engine is the daemon's
  std::random_device random;
  for (RobotConfig& robot : config.robots) {
    robot.client.boot_counter = static_cast<uint16_t>(random());
    robot.client.buffered_link = links == LinkKind::kBuffered;
    robot.client.rounds &= links != LinkKind::kBuffered;
    robot.client.gap_timeout_ms = kBufferedGapMs;
  }
  return config;
}

}  // namespace

SwarmRecord RunScenario(const Scenario& scenario, const std::function<void(int64_t ms)>& show) {
  Simulation simulation(SetUp(scenario));
  Recorder recorder(&simulation.swarm(), scenario.engine.field, scenario.sample_ms);
  for (int64_t ms = 0; ms <= scenario.duration_ms; ++ms) {
    simulation.RunTo(ms);
    if (recorder.Look() && show) {
      show(ms);
    }
  }
  SwarmRecord record = recorder.Finish();
  for (size_t i = 0; i < record.channels.size(); ++i) {
    record.channels[i].late_answers = simulation.server(i).counters().late_answers;
  }
  record.state_hash = simulation.state_hash();
  return record;
}

Result<SwarmRecord> RunScenarioLive(const Scenario& scenario, const std::vector<std::string>& ports,
                                    const std::string& keys_file, LinkKind links,
                                    const volatile std::sig_atomic_t* stop,
                                    const std::function<void(const LiveSwarm&)>& show) {
  if (ports.size() != static_cast<size_t>(scenario.channels)) {
    return Error{fmt::format("{} has {} channels, but {} ports are given: expected one per channel",
                             scenario.name, scenario.channels, ports.size())};
  }
  SwarmConfig config = SetUpLive(scenario, links);
  PHEROMONE_TRY(const keys::RobotsKeys robots_keys, SignWith(keys_file, &config));
  LiveSwarm live(config, ports, scenario.timing.adapter_ns);
  PHEROMONE_TRY_STATUS(live.Open());
  Recorder recorder(&live.swarm(), scenario.engine.field, scenario.sample_ms);
  live.Run(scenario.duration_ms, stop, [&] {
    if (recorder.Look()) {
      show(live);
    }
  });
  SwarmRecord record = recorder.Finish();
  for (size_t i = 0; i < record.channels.size(); ++i) {
    record.channels[i].reconnects = live.modem(i).reconnects();
  }
  return record;
}

std::string FramesForDaemon(const Scenario& scenario) {
  std::string text;
  for (const engine::RobotFrame& frame : SetUp(scenario).engine.frames) {
    text += fmt::format(
        "[[frame]]\nlink = \"{}\"\nid = {}\nx_m = {:.6f}\ny_m = {:.6f}\nheading_deg = {:.3f}\n",
        frame.link, frame.id, static_cast<double>(frame.x_um) / 1e6,
        static_cast<double>(frame.y_um) / 1e6, frame.heading * 360.0 / 65536);
  }
  return text;
}

}  // namespace pheromone::swarm
