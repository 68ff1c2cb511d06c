#include "client_fw/experiments/bridge/simulation.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <random>

#include "protocol/frame.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr int64_t kAdvanceMs = 100;  // how often the engine may do what is due
constexpr int64_t kMaximumMicro = 1'000'000;
constexpr double kEntryM = 0.5;  // of a branch, as looked at before a choice
constexpr double kEntryStepM = 0.02;

int64_t ToUm(double metres) {
  return std::llround(metres * 1e6);
}

sim::RadioConfig RadioOf(uint64_t seed) {
  sim::RadioConfig radio;
  radio.seed = seed;
  return radio;
}

// The nodes of the corridor behind the wedge, where the branches are apart.
std::vector<field::NodeIndex> EntryOf(const BridgeArena& arena, Branch branch, bool outbound,
                                      const field::MapGeometry& map) {
  const Lane& lane = arena.lane(
      branch == Branch::kShort ? BridgeArena::kShortBranch : BridgeArena::kLongBranch, outbound);
  std::vector<field::NodeIndex> nodes;
  const auto steps = [](double metres) {
    return static_cast<int>(std::lround(metres / kEntryStepM));
  };
  const int aside = steps(arena.shape().free_m);
  for (int i = 0; i <= steps(kEntryM); ++i) {
    const sim::PlanePose at = lane.At(arena.wedge_m() + i * kEntryStepM);
    for (int j = -aside; j <= aside; ++j) {
      const double left_m = j * kEntryStepM;
      nodes.push_back(map.NearestNode({ToUm(at.x_m - left_m * std::sin(at.heading_rad)),
                                       ToUm(at.y_m + left_m * std::cos(at.heading_rad))}));
    }
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

field::Path PathAlong(const Lane& lane, uint16_t count) {
  field::Path path;
  path.type = BridgeExperiment::kTrail;
  path.count = count;
  for (const Lane::Point& point : lane.points()) {
    path.points.push_back({ToUm(point.x_m), ToUm(point.y_m)});
  }
  return path;
}

std::vector<field::Path> LaidPaths(const BridgeExperiment& experiment) {
  std::vector<field::Path> paths;
  const BridgeArena arena(experiment.shape);
  const auto [on_short, on_long] = experiment.laid;
  const uint16_t on_stems = on_short + on_long > 0 ? experiment.max_count : uint16_t{0};
  const std::array<uint16_t, BridgeArena::kCorridors> counts = {on_stems, on_short, on_long,
                                                                on_stems};
  for (const auto corridor : {BridgeArena::kNestStem, BridgeArena::kShortBranch,
                              BridgeArena::kLongBranch, BridgeArena::kFoodStem}) {
    if (counts[corridor] > 0) {
      paths.push_back(PathAlong(arena.lane(corridor, true), counts[corridor]));
    }
  }
  return paths;
}

}  // namespace

engine::EngineConfig EngineConfigOf(const BridgeExperiment& experiment) {
  field::PheromoneLaw trail;
  trail.type = BridgeExperiment::kTrail;
  trail.name = "trail";
  trail.core_um = ToUm(experiment.core_m);
  trail.sigma_um = ToUm(experiment.sigma_m);
  trail.evaporation = experiment.evaporation;
  trail.tau_ms = experiment.tau_ms;
  trail.quantum_micro = kMaximumMicro / experiment.max_count;
  trail.max_count = experiment.max_count;
  engine::EngineConfig config;
  config.field.map = {
      .origin = {0, 0}, .width_um = ToUm(7), .height_um = ToUm(4.4), .cell_um = ToUm(0.1)};
  config.field.antennas.distance_um = ToUm(experiment.antenna_distance_m);
  config.field.pheromones = {trail};
  config.field.paths = LaidPaths(experiment);
  config.field.memory_bytes = 16 << 20;
  config.links = {{"radio-a", 3, 20}};
  return config;
}

BridgeSimulation::BridgeSimulation(const BridgeExperiment& experiment, uint64_t seed)
    : experiment_(experiment),
      arena_(experiment.shape),
      service_(&log_,
               [this] {
                 return engine::ClockReading{static_cast<uint64_t>(now_ms_), now_ms_};
               }),
      decoder_(protocol::kNoGapTimeout) {
  std::mt19937_64 random(seed);
  const engine::EngineConfig config = EngineConfigOf(experiment);
  const auto configured = service_.Configure(config, 1);
  assert(configured.ok());
  (void)configured;
  const uint64_t radio_seed = random();
  if (experiment.radio) {
    const sim::RadioConfig radio = RadioOf(radio_seed);
    medium_.emplace(radio);
    server_.emplace(&service_, engine::LinkIndex{0}, config.links[0], &*medium_, ServerTiming{});
  }
  for (int i = 0; i < experiment.robots; ++i) {
    BridgeRobotConfig robot;
    robot.client.id = static_cast<uint8_t>(1 + i);
    robot.client.type = BridgeExperiment::kTrail;
    robot.client.boot_counter = static_cast<uint16_t>(random());
    robot.client.speed_mm_s = experiment.speed_mm_s;
    robot.client.period_ms = experiment.period_ms;
    robot.client.lay_trail = experiment.lay_trail;
    robot.client.law = client::Law::kDifferential;  // at the same speed on a weak trail
    robot.client.lost_after_ms = 0;                 // at first there is no trail: straight on
    robot.wandering = experiment.wandering;
    robot.seed = random();
    robots_.emplace_back(robot, &arena_);
    releases_ms_.push_back(
        static_cast<int64_t>(random() % static_cast<uint64_t>(experiment.release_ms + 1)));
    if (medium_) {
      stations_.push_back(medium_->AddStation(&robots_.back()));
    }
  }
  for (const bool outbound : {false, true}) {
    for (const Branch branch : {Branch::kShort, Branch::kLong}) {
      entries_[outbound ? 1 : 0][static_cast<size_t>(branch)] =
          EntryOf(arena_, branch, outbound, config.field.map);
    }
  }
}

void BridgeSimulation::RunTo(int64_t ms) {
  const int64_t step_ms = medium_ ? 1 : kStepMs;
  while (now_ms_ + step_ms <= ms) {
    now_ms_ += step_ms;
    if (medium_) {
      server_->AdvanceTo(now_ms_ * kNsPerMs);
    } else if (now_ms_ % kAdvanceMs == 0) {
      std::vector<engine::Outgoing> none;
      service_.AdvanceIfDue(&none);
    }
    for (size_t i = 0; i < robots_.size(); ++i) {
      if (released(i)) {
        Drive(i, step_ms);
      }
    }
  }
}

void BridgeSimulation::Drive(size_t number, int64_t step_ms) {
  BridgeRobot& robot = robots_[number];
  const BridgeGuide& guide = robot.guide();
  const bool short_open = now_ms_ >= experiment_.short_opens_ms;
  if (robot.Advance(static_cast<double>(step_ms) / 1000, short_open) == BridgeGuide::Step::kChose) {
    choices_.push_back({now_ms_, guide.outbound(), guide.branch(), ShortTrail(guide.outbound())});
  }
  if (guide.on_branch()) {
    time_on_ms_[static_cast<size_t>(guide.branch())] += step_ms;
  }
  robot.Step(now_ms_, medium_ && medium_->Busy(stations_[number]));
  std::array<uint8_t, client::kMaxClientFrame> frame{};
  const size_t size = robot.TakeTransmission(frame);
  if (medium_) {
    medium_->Transmit(stations_[number], std::span(frame.data(), size));
  } else if (size != 0) {
    ExchangeIdeally(&robot, std::span(frame.data(), size));
  }
}

// The request is handled at once; its answer waits for the robot's next step.
void BridgeSimulation::ExchangeIdeally(BridgeRobot* robot, std::span<const uint8_t> request) {
  const int64_t now_ns = now_ms_ * kNsPerMs;
  robot->OnTransmitted(now_ns);
  std::vector<engine::Outgoing> answers;
  for (const uint8_t byte : request) {
    if (decoder_.Push(byte, static_cast<uint32_t>(now_ms_))) {
      service_.Handle(0, {&decoder_.message(), 1}, &answers);
    }
  }
  for (const engine::Outgoing& answer : answers) {
    std::array<uint8_t, protocol::kMaxFrame> frame{};
    const size_t size = protocol::EncodeFrame(answer.message, frame.data(), frame.size());
    for (const uint8_t byte : std::span(frame.data(), size)) {
      robot->OnByte(byte, now_ns);
    }
  }
}

double BridgeSimulation::ShortTrail(bool outbound) const {
  std::array<double, 2> trail{};
  service_.Inspect([&](const engine::Engine& engine) {
    for (size_t branch = 0; branch < trail.size(); ++branch) {
      for (const field::NodeIndex node : entries_[outbound ? 1 : 0][branch]) {
        trail[branch] +=
            engine.field().LevelOf(BridgeExperiment::kTrail, node, static_cast<uint64_t>(now_ms_));
      }
    }
  });
  const double sum = trail[0] + trail[1];
  return sum > 0 ? trail[0] / sum : 0.5;
}

}  // namespace pheromone::swarm
