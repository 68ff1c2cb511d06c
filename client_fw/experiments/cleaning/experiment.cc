#include "client_fw/experiments/cleaning/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <random>

#include "client_fw/swarm/live.h"

namespace pheromone::swarm {
namespace {

constexpr int kMostRobots = 254;  // IDs of a link
constexpr double kUmInMetre = 1e6;
constexpr char kOperator[] = "operator";  // the author of what pheromonectl writes

int64_t Um(double metres) {
  return std::llround(metres * kUmInMetre);
}

engine::EngineConfig ServerOf(const CleaningExperiment& experiment) {
  const CleaningGrid& grid = experiment.grid;
  field::PheromoneLaw unused;  // robots that clean ask for intensities all the same
  unused.type = 1;
  unused.name = "unused";
  unused.core_um = Um(0.1);
  unused.sigma_um = Um(0.4);
  unused.quantum_micro = 125'000;
  unused.max_count = 8;
  engine::EngineConfig config;
  config.field.map = {.origin = {0, 0},
                      .width_um = Um(grid.width_m()),
                      .height_um = Um(grid.height_m()),
                      .cell_um = Um(0.1)};
  config.field.pheromones = {unused};
  config.field.memory_bytes = 64 << 20;
  for (int i = 0; i < experiment.channels; ++i) {
    config.links.push_back(experiment.timing.Link(fmt::format("radio-{}", i + 1)));
  }
  tags::Settings& tags = config.tags;
  if (experiment.closed != 0) {
    tags.privileged = {kOperator};
  }
  for (int zone = 0; zone < grid.zones(); ++zone) {
    tags.tags.push_back({.name = fmt::format("zone-{}", zone + 1),
                         .x_um = Um(grid.CentreX(zone)),
                         .y_um = Um(grid.CentreY(zone)),
                         .range_um = Um(grid.RangeOf(zone)),
                         .slots = static_cast<uint8_t>(experiment.slots)});
  }
  return config;
}

// Keeps robots away from closed zones, with signs as `pheromonectl tags` writes them.
void Close(const CleaningExperiment& experiment, engine::Service* service) {
  using engine::TagsChanged;
  using tags::RowKind;
  constexpr int32_t kNumber = 1'000;  // none that robots are given
  constexpr int32_t kString = 1;
  std::vector<engine::Outgoing> out;
  const auto change = [&](const TagsChanged& it) {
    const auto submitted = service->Submit(it, &out);
    assert(submitted.ok());
    static_cast<void>(submitted);
  };
  change({TagsChanged::Define{{RowKind::kRobot, kNumber, kNumber, kOperator}}});
  change({TagsChanged::Define{
      {RowKind::kString, kNumber, kString, std::string(client::kCleaningBase) + "keepAway"}}});
  for (int zone = 0; zone < experiment.grid.zones(); ++zone) {
    if (experiment.IsClosed(zone)) {
      const int32_t tag = zone + 1;
      change({TagsChanged::Write{.tag = static_cast<uint16_t>(tag),
                                 .block = {kNumber, 0, {-18, tag}, {0, kString}, {-17, kNumber}}}});
    }
  }
}

// Sees who begins and ends, millisecond by millisecond.
class Attendance {
 public:
  Attendance(const CleaningExperiment& experiment, const Swarm* swarm, CleaningRun* run)
      : grid_(experiment.grid),
        sample_ms_(experiment.sample_ms),
        swarm_(swarm),
        run_(run),
        robots_(swarm->robot_count()) {
    run_->tracks.resize(swarm->robot_count());
  }

  void Look(int64_t now_ms) {
    for (size_t i = 0; i < robots_.size(); ++i) {
      const client::Cleaner* cleaner = swarm_->robot(i).cleaner();
      const bool is_cleaning = cleaner != nullptr && cleaner->is_cleaning();
      if (is_cleaning && !robots_[i].cleaning) {
        Begin(i, *cleaner, now_ms);
      } else if (!is_cleaning && robots_[i].cleaning) {
        const bool is_done = cleaner != nullptr && cleaner->lost_claims() == robots_[i].lost_claims;
        End(i, is_done, now_ms);
      }
      if (sample_ms_ > 0 && now_ms % sample_ms_ == 0) {
        run_->tracks[i].push_back(swarm_->robot(i).true_pose());
      }
    }
  }

  void Finish(int64_t now_ms) {
    for (size_t i = 0; i < robots_.size(); ++i) {
      if (robots_[i].cleaning) {
        End(i, false, now_ms);
      }
      const sim::MobileRobot& robot = swarm_->robot(i);
      run_->lost_claims += robot.cleaner() != nullptr ? robot.cleaner()->lost_claims() : 0;
      run_->tag_requests += robot.counters().tag_requests;
      run_->fail_safe_stops += robot.counters().fail_safe_stops;
    }
    run_->together_ms = TogetherMs(run_->cleanings);
    for (size_t channel = 0; channel < swarm_->channel_count(); ++channel) {
      run_->utilisation = std::max(run_->utilisation, swarm_->medium(channel).Utilisation());
    }
  }

 private:
  struct Robot {
    std::optional<size_t> cleaning = {};  // of the run's
    uint32_t lost_claims = 0;             // when that began
  };

  void Begin(size_t robot, const client::Cleaner& cleaner, int64_t now_ms) {
    const sim::PlanePose& pose = swarm_->robot(robot).true_pose();
    const int zone = grid_.ZoneAt(pose.x_m, pose.y_m);
    robots_[robot] = {run_->cleanings.size(), cleaner.lost_claims()};
    run_->cleanings.push_back({.zone = zone, .robot = static_cast<int>(robot), .begin_ms = now_ms});
    run_->misplaced += cleaner.target() == zone + 1 ? 0 : 1;
  }

  void End(size_t robot, bool is_done, int64_t now_ms) {
    Cleaning& cleaning = run_->cleanings[*robots_[robot].cleaning];
    cleaning.end_ms = now_ms;
    cleaning.is_done = is_done;
    robots_[robot].cleaning.reset();
  }

  const CleaningGrid& grid_;
  int64_t sample_ms_;
  const Swarm* swarm_;
  CleaningRun* run_;
  std::vector<Robot> robots_;
};

}  // namespace

int64_t CleaningExperiment::LeaseSeconds() const {
  return lease_s != 0 ? lease_s : (2 * cleaning_ms + 999) / 1000 + 2;
}

double CleaningExperiment::IdealCycleSeconds() const {
  const double move_s = grid.zone_m * 1000 / speed_mm_s;
  return open_zones() * (move_s + static_cast<double>(cleaning_ms) / 1000) / robots;
}

std::string WhatIsWrong(const CleaningExperiment& experiment) {
  const int zones = experiment.open_zones();
  if (experiment.robots > zones) {
    return fmt::format("{} robots in {} zones, expected at most one in each", experiment.robots,
                       zones);
  }
  if (experiment.robots > kMostRobots) {
    return fmt::format("{} robots, expected at most {}", experiment.robots, kMostRobots);
  }
  if (experiment.channels > experiment.robots) {
    return fmt::format("{} channels for {} robots, expected at most one for each",
                       experiment.channels, experiment.robots);
  }
  if (experiment.cleaning_ms > UINT16_MAX || experiment.LeaseSeconds() > UINT16_MAX) {
    return fmt::format("cleaning for {} s with a lease of {} s, expected at most {} and {} s",
                       static_cast<double>(experiment.cleaning_ms) / 1000,
                       experiment.LeaseSeconds(), UINT16_MAX / 1000, UINT16_MAX);
  }
  if (1000 * experiment.LeaseSeconds() < experiment.cleaning_ms + 1000) {
    return fmt::format("a lease of {} s and cleaning for {} s, expected 1 s more",
                       experiment.lease_s, static_cast<double>(experiment.cleaning_ms) / 1000);
  }
  if (experiment.switch_off && experiment.switch_off->robot >= experiment.robots) {
    return fmt::format("there is no robot {} to switch off", experiment.switch_off->robot + 1);
  }
  return {};
}

SimulationConfig SimulationOf(const CleaningExperiment& experiment, uint64_t seed) {
  std::mt19937_64 random(seed);
  SimulationConfig config;
  config.engine = ServerOf(experiment);
  config.channels = static_cast<size_t>(experiment.channels);
  config.radio.baud = experiment.timing.baud;
  config.radio.turnaround_ns = experiment.timing.turnaround_ns;
  config.radio.block_loss = experiment.frame_loss;
  config.radio.seed = random();
  config.server.delay_ns = experiment.timing.server_delay_ns;
  std::vector<int> zones(static_cast<size_t>(experiment.grid.zones()));
  for (size_t i = 0; i < zones.size(); ++i) {
    zones[i] = static_cast<int>(i);
  }
  std::erase_if(zones, [&](int zone) { return experiment.IsClosed(zone); });
  for (int i = 0; i < experiment.robots; ++i) {
    const auto at = static_cast<size_t>(i);
    std::swap(zones[at], zones[at + random() % (zones.size() - at)]);
    const int start = experiment.starts.empty() ? zones[at] : experiment.starts[at];
    RobotConfig robot;
    client::PrepareForCleaning(&robot.client);
    robot.client.id = static_cast<uint8_t>(i + 1);
    robot.client.boot_counter = static_cast<uint16_t>(random());
    robot.client.speed_mm_s = experiment.speed_mm_s;
    robot.client.period_ms = experiment.period_ms;
    robot.client.fail_safe_ms = std::max<uint16_t>(robot.client.fail_safe_ms,
                                                   static_cast<uint16_t>(4 * experiment.period_ms));
    robot.cleaner =
        client::CleanerParameters{.cleaning_ms = static_cast<uint16_t>(experiment.cleaning_ms),
                                  .lease_s = static_cast<uint16_t>(experiment.LeaseSeconds())};
    robot.start = {experiment.grid.CentreX(start), experiment.grid.CentreY(start),
                   static_cast<double>(random() % 360) * std::numbers::pi / 180};
    if (experiment.switch_off && experiment.switch_off->robot == i) {
      robot.power_off_ms = experiment.switch_off->time_ms;
    }
    config.robots.push_back(robot);
  }
  return config;
}

CleaningRun RunCleaning(const CleaningExperiment& experiment, uint64_t seed,
                        const std::function<void(int64_t second)>& on_second) {
  Simulation simulation(SimulationOf(experiment, seed));
  if (experiment.closed != 0) {
    Close(experiment, &simulation.service());
  }
  CleaningRun run;
  Attendance attendance(experiment, &simulation.swarm(), &run);
  for (int64_t ms = 0; ms <= experiment.duration_ms; ++ms) {
    simulation.RunTo(ms);
    attendance.Look(ms);
    if (on_second && ms > 0 && ms % 1000 == 0) {
      on_second(ms / 1000);
    }
  }
  attendance.Finish(experiment.duration_ms);
  run.end_ms = experiment.duration_ms;
  run.state_hash = simulation.state_hash();
  return run;
}

Result<CleaningRun> RunCleaningLive(const CleaningExperiment& experiment, uint64_t seed,
                                    const std::vector<std::string>& ports,
                                    const std::string& keys_file,
                                    const volatile std::sig_atomic_t* stop,
                                    const std::function<void(int64_t second)>& on_second) {
  if (ports.size() != static_cast<size_t>(experiment.channels)) {
    return Error{fmt::format("{} ports for {} channels, expected one for each", ports.size(),
                             experiment.channels)};
  }
  SimulationConfig config = SimulationOf(experiment, seed);
  std::random_device random;  // a daemon may remember robots of earlier runs
  for (RobotConfig& robot : config.robots) {
    robot.client.boot_counter = static_cast<uint16_t>(random());
    robot.client.buffered_link = true;
    robot.client.gap_timeout_ms = kBufferedGapMs;
  }
  PHEROMONE_TRY(const keys::RobotsKeys robots_keys, SignWith(keys_file, &config));
  LiveSwarm live(config, ports, experiment.timing.adapter_ns);
  if (const Status opened = live.Open(); !opened.ok()) {
    return opened.error();
  }
  CleaningRun run;
  Attendance attendance(experiment, &live.swarm(), &run);
  live.Run(experiment.duration_ms, stop, [&] {
    const int64_t ms = live.swarm().now_ms();
    attendance.Look(ms);
    if (on_second && ms > 0 && ms % 1000 == 0) {
      on_second(ms / 1000);
    }
  });
  run.end_ms = live.swarm().now_ms();
  attendance.Finish(run.end_ms);
  return run;
}

CleaningSummary Summarise(const CleaningExperiment& experiment, const CleaningRun& run) {
  CleaningSummary summary;
  const int64_t end_ms = experiment.duration_ms;
  for (const Cleaning& cleaning : run.cleanings) {
    summary.done += cleaning.is_done ? 1 : 0;
  }
  double gaps_s = 0;
  uint64_t gaps = 0;
  for (int zone = 0; zone < experiment.grid.zones(); ++zone) {
    if (experiment.IsClosed(zone)) {
      continue;
    }
    const double gap_s = static_cast<double>(WorstGapMs(zone, run.cleanings, end_ms)) / 1000;
    if (gap_s > summary.worst_gap_s) {
      summary.worst_gap_s = gap_s;
      summary.worst_zone = zone;
    }
    summary.highest_percent = std::max(
        summary.highest_percent,
        HighestPercent(SoilOf(experiment.grid, experiment.soil, zone, run.cleanings, end_ms)));
    int64_t since_ms = -1;
    for (const Cleaning& cleaning : run.cleanings) {
      if (cleaning.zone == zone && cleaning.is_done) {
        gaps_s += since_ms >= 0 ? static_cast<double>(cleaning.begin_ms - since_ms) / 1000 : 0;
        gaps += since_ms >= 0 ? 1 : 0;
        since_ms = cleaning.end_ms;
      }
    }
  }
  summary.mean_gap_s = gaps > 0 ? gaps_s / static_cast<double>(gaps) : 0;
  if (summary.done > 0) {
    summary.turn_s =
        static_cast<double>(end_ms) / 1000 * experiment.robots / static_cast<double>(summary.done);
    summary.cycle_s = summary.turn_s * experiment.open_zones() / experiment.robots;
  }
  return summary;
}

}  // namespace pheromone::swarm
