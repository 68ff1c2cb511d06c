#include "client_fw/experiments/trails/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include "client_fw/core/tasks/robot_net.h"
#include "client_fw/experiments/trails/bodies.h"
#include "client_fw/swarm/live.h"
#include "client_fw/swarm/simulation.h"

namespace pheromone::swarm {
namespace {

constexpr int kMaxRobots = 254;    // IDs of a link
constexpr double kTouchM = 0.005;  // from rim to rim
constexpr std::string_view kModel = "p3dx-sh";

std::string LinkName(int channel) {
  return fmt::format("radio-{}", channel + 1);
}

bool IsAvr(const TrailsExperiment& experiment, int robot) {
  return robot >= experiment.rules.robots - experiment.avr_robots;
}

// The robots, and what is seen of them. It does not move while the swarm exists.
class Watch {
 public:
  Watch(const TrailsBench& bench, const TrailsExperiment& experiment, uint64_t seed)
      : experiment_(experiment), bodies_(kBenchRobotRadiusM) {
    run_.robots = experiment.rules.robots;
    run_.ledger = TrailsLedger(run_.robots);
    run_.least_gap_m = std::numeric_limits<double>::infinity();
    std::mt19937_64 random(seed);
    swarm_.channels = static_cast<size_t>(experiment.channel_count());
    swarm_.radio.baud = experiment.timing.baud;
    swarm_.radio.turnaround_ns = experiment.timing.turnaround_ns;
    swarm_.radio.block_loss = experiment.frame_loss;
    swarm_.radio.seed = random();
    for (int i = 0; i < run_.robots; ++i) {
      swarm_.robots.push_back(RobotAt(bench.QueuePlace(i), i, static_cast<uint16_t>(random())));
    }
    swarm_.add_listener = [this](size_t /*channel*/, sim::RadioMedium* medium) {
      medium->AddStation(&tallies_.emplace_back(
          [this](const NetTold& told) { run_.ledger.Add(told); }, is_signed_));
    };
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  SwarmConfig& config() { return swarm_; }
  /// Before there is a channel.
  void set_signed(bool is_signed) { is_signed_ = is_signed; }
  TrailsRun& run() { return run_; }

  bool IsDone(int64_t now_ms) const {
    return now_ms >= experiment_.duration_ms ||
           (experiment_.trips != 0 && run_.ledger.trips() >= experiment_.trips);
  }

  // Every millisecond.
  void Look(const Swarm& swarm, int64_t now_ms) {
    for (size_t i = 0; i < swarm.robot_count(); ++i) {
      bodies_.Move(i, swarm.robot(i).true_pose());
    }
    const double gap_m = bodies_.Nearest().gap_m;
    run_.least_gap_m = std::min(run_.least_gap_m, gap_m);
    run_.collisions += gap_m < kTouchM && !touching_ ? 1 : 0;
    touching_ = gap_m < kTouchM;
    if (experiment_.snapshot_ms != 0 && now_ms % experiment_.snapshot_ms == 0) {
      std::vector<sim::PlanePose>& poses = run_.snapshots.emplace_back();
      for (size_t i = 0; i < swarm.robot_count(); ++i) {
        poses.push_back(swarm.robot(i).true_pose());
      }
    }
  }

  TrailsRun Finish(const Swarm& swarm) {
    run_.duration_ms = swarm.now_ms();
    for (size_t i = 0; i < swarm.robot_count(); ++i) {
      const sim::MobileRobot& robot = swarm.robot(i);
      run_.bumps += robot.bumps();
      run_.fail_safe_stops += robot.counters().fail_safe_stops;
      if (robot.forager() != nullptr) {
        run_.CountOwn(robot.forager()->net_robot());
      }
    }
    for (size_t i = 0; i < swarm.channel_count(); ++i) {
      run_.utilisation = std::max(run_.utilisation, swarm.medium(i).Utilisation());
    }
    return std::move(run_);
  }

 private:
  RobotConfig RobotAt(const sim::PlanePose& start, int number, uint16_t boot_counter) {
    RobotConfig robot;
    client::PrepareForForaging(client::kRobotNet, &robot.client);
    robot.client.id = static_cast<uint8_t>(number + 1);
    robot.client.boot_counter = boot_counter;
    robot.client.speed_mm_s = experiment_.speed_mm_s;
    robot.client.period_ms = experiment_.period_ms;
    robot.client.sonar = true;  // for the queues
    robot.forager = experiment_.robot;
    robot.pioneer = sim::FindPioneerModel(kModel);
    robot.radius_m = kBenchRobotRadiusM;
    robot.start = start;
    const size_t body = bodies_.Add(start);
    robot.range = bodies_.RangeFrom(body);
    robot.drive.blocked = bodies_.BlockedFor(body);
    robot.image = IsAvr(experiment_, number) ? BuiltForagerImage() : std::string();
    return robot;
  }

  const TrailsExperiment& experiment_;
  Bodies bodies_;
  bool is_signed_ = false;
  std::deque<NetTally> tallies_;  // a deque, because media point at them
  SwarmConfig swarm_;
  TrailsRun run_;
  bool touching_ = false;
};

}  // namespace

std::string WhatIsWrong(const TrailsBench& bench, const TrailsExperiment& experiment) {
  const int robots = experiment.rules.robots;
  if (robots > bench.QueuePlaces()) {
    return fmt::format("{} robots, but the nest of {} has room for {}", robots, bench.name,
                       bench.QueuePlaces());
  }
  if (robots > kMaxRobots) {
    return fmt::format("{} robots, expected at most {}", robots, kMaxRobots);
  }
  if (experiment.channels > robots) {
    return fmt::format("{} channels for {} robots, expected at most one for each",
                       experiment.channels, robots);
  }
  if (experiment.avr_robots > robots) {
    return fmt::format("{} AVR robots of {}, expected at most all of them", experiment.avr_robots,
                       robots);
  }
  if (experiment.avr_robots > 0 && !HasAvrRobots()) {
    return "AVR robots need a pheromone-swarm with libsimavr (pheromone-swarm --version)";
  }
  return {};
}

std::vector<engine::RobotFrame> FramesOf(const TrailsBench& bench,
                                         const TrailsExperiment& experiment) {
  std::vector<engine::RobotFrame> frames;
  for (int i = 0; i < experiment.rules.robots; ++i) {
    if (IsAvr(experiment, i)) {
      const sim::PlanePose start = bench.QueuePlace(i);
      frames.push_back(
          engine::MakeFrame(LinkName(i % experiment.channel_count()), static_cast<uint8_t>(i + 1),
                            {std::llround(start.x_m * 1e6), std::llround(start.y_m * 1e6)},
                            start.heading_rad * 180 / std::numbers::pi));
    }
  }
  return frames;
}

Result<TrailsRun> RunTrails(const TrailsBench& bench, const TrailsExperiment& experiment,
                            uint64_t seed, const ShowTrails& show) {
  PHEROMONE_TRY(engine::EngineConfig configured, ConfigWith(bench, experiment.rules));
  Watch watch(bench, experiment, seed);
  SimulationConfig config;
  static_cast<SwarmConfig&>(config) = watch.config();
  config.engine = std::move(configured);
  config.engine.links.clear();
  for (int i = 0; i < experiment.channel_count(); ++i) {
    config.engine.links.push_back(experiment.timing.Link(LinkName(i)));
  }
  config.engine.frames = FramesOf(bench, experiment);
  config.server.delay_ns = experiment.timing.server_delay_ns;
  Simulation simulation(config);
  for (int64_t ms = 0; !watch.IsDone(ms); simulation.RunTo(++ms)) {
    watch.Look(simulation.swarm(), ms);
    if (experiment.sample_ms > 0 && ms % experiment.sample_ms == 0) {
      TrailsSample sample = simulation.service().Inspect([ms](const engine::Engine& engine) {
        return SampleOf(engine, static_cast<uint64_t>(ms));
      });
      const TrailsLedger& ledger = watch.run().ledger;
      sample.robots_on = {ledger.robots_on(BenchTrail::kA), ledger.robots_on(BenchTrail::kB)};
      watch.run().samples.push_back(sample);
    }
    if (show && ms % 1000 == 0) {
      show({ms, watch.run().ledger, simulation.swarm()});
    }
  }
  TrailsRun run = watch.Finish(simulation.swarm());
  simulation.service().Inspect(
      [&](const engine::Engine& engine) { run.server = NetIn(engine)->counts(); });
  run.state_hash = simulation.state_hash();
  return run;
}

Result<TrailsRun> RunTrailsLive(const TrailsBench& bench, const TrailsExperiment& experiment,
                                const std::vector<std::string>& ports, const std::string& keys_file,
                                const volatile std::sig_atomic_t* stop, const ShowTrails& show) {
  if (ports.size() != static_cast<size_t>(experiment.channel_count())) {
    return Error{fmt::format("{} ports for {} channels, expected one for each", ports.size(),
                             experiment.channel_count())};
  }
  std::random_device random;  // a daemon may remember robots of earlier runs
  Watch watch(bench, experiment, random());
  for (RobotConfig& robot : watch.config().robots) {
    robot.client.buffered_link = true;
    robot.client.rounds = false;
    robot.client.gap_timeout_ms = kBufferedGapMs;
  }
  PHEROMONE_TRY(const keys::RobotsKeys robots_keys, SignWith(keys_file, &watch.config()));
  watch.set_signed(!robots_keys.keys.empty());
  LiveSwarm live(watch.config(), ports, experiment.timing.adapter_ns);
  if (const Status opened = live.Open(); !opened.ok()) {
    return opened.error();
  }
  std::sig_atomic_t done = 0;
  const volatile std::sig_atomic_t* const until = &done;
  live.Run(0, until, [&] {
    const int64_t now_ms = live.swarm().now_ms();
    watch.Look(live.swarm(), now_ms);
    if (show && now_ms % 1000 == 0) {
      show({now_ms, watch.run().ledger, live.swarm()});
    }
    done = *stop != 0 || watch.IsDone(now_ms) ? 1 : 0;
  });
  return watch.Finish(live.swarm());
}

}  // namespace pheromone::swarm
