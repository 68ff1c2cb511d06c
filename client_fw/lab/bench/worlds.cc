#include "client_fw/lab/bench/worlds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <utility>

#include "client_fw/lab/behaviours/follow.h"
#include "client_fw/lab/firmware/firmware_swarm.h"
#include "client_fw/lab/starts.h"

namespace pheromone::lab::bench {
namespace {

constexpr int64_t kCellUm = 100'000;
constexpr int kReachCells = 5;
// A node holds one to three quanta after a robot has passed, so a trail has some 25 nodes.
constexpr int64_t kTauMs = 15'000;

client::Settings Settings() {
  client::Settings settings;
  settings.lost_trail = client::LostTrail::kStraight;
  settings.lay_trail = true;
  return settings;
}

template <typename T>
T OrAbort(Result<T> result) {
  if (!result.ok()) {
    fmt::print(stderr, "{}\n", result.error());
    std::abort();
  }
  return std::move(result).value();
}

WorldConfig ConfigOf(const Size& size, int threads) {
  WorldConfig config;
  const double side_m = std::sqrt(static_cast<double>(size.robots) * size.square_m_per_robot);
  const auto side_um = static_cast<int64_t>(side_m * 1e6);
  config.field.map = {
      .origin = {0, 0}, .width_um = side_um, .height_um = side_um, .cell_um = kCellUm};
  config.field.antennas.distance_um = 330'000;
  config.field.memory_bytes = uint64_t{1} << 30;
  field::PheromoneLaw law;
  law.core_um = 100'000;
  law.sigma_um = 400'000;
  law.tau_ms = kTauMs;
  law.quantum_micro = 125'000;
  law.max_count = 8;
  config.field.pheromones = {law};
  config.threads = threads;
  RobotGroup group;
  group.name = "ants";
  group.senses = {1};
  group.deposits = 1;
  StartPlacer placer(config.field, group.radius_m, config.seed);
  while (group.starts.size() < size.robots) {
    group.starts.push_back(placer.Find(AreaOf(config.field.map), group.radius_m).value());
  }
  group.behaviour = MakeFollow(Settings(), 1, size.robots);
  config.groups = {std::move(group)};
  return config;
}

}  // namespace

std::unique_ptr<World> MakeWorld(const Size& size, int threads) {
  return OrAbort(World::Create(ConfigOf(size, threads)));
}

std::unique_ptr<World> MakeFirmwareWorld(const Size& size, int threads) {
  WorldConfig config = ConfigOf(size, threads);
  config.step_ms = kFirmwareStepMs;
  FirmwareConfig firmware;
  firmware.engine.field = config.field;
  client::Parameters robot;
  static_cast<client::Settings&>(robot) = Settings();
  firmware.robots.assign(size.robots, robot);
  firmware.radio = {.robots_per_channel = 8, .lost_percent = 1};
  RobotGroup& group = config.groups.front();
  group.senses.clear();
  group.deposits = 0;
  group.behaviour = OrAbort(FirmwareSwarm::Create(std::move(firmware)));
  return OrAbort(World::Create(std::move(config)));
}

DenseWorld::DenseWorld(const Size& size)
    : world_(MakeWorld(size, 1)),
      grid_(world_->field().config().map, world_->field().config().antennas.distance_um,
            kReachCells) {}

void DenseWorld::Step() {
  Robots& robots = world_->mutable_robots();
  const auto intensity = [](double units) {
    return static_cast<int16_t>(std::min(units * client::kIntensityUnit, 32'767.0));
  };
  for (size_t i = 0; i < robots.count; ++i) {
    const client::Pose pose =
        sim::ToClientPose({robots.x_m[i], robots.y_m[i], robots.heading_rad[i]});
    robots.sensed_x[i] = pose.x_mm;
    robots.sensed_y[i] = pose.y_mm;
    robots.sensed_heading[i] = pose.heading;
    robots.on_map[i] = 1;
    const field::bench::Smell p =
        grid_.Sense({{pose.x_mm * int64_t{1000}, pose.y_mm * int64_t{1000}}, pose.heading});
    robots.p_left[0][i] = intensity(p.left);
    robots.p_right[0][i] = intensity(p.right);
  }
  if (!world_->Run(World::Phase::kBehave).ok()) {
    std::abort();
  }
  const field::bench::Wide& wide = field::bench::BestWide();
  for (size_t i = 0; i < robots.count; ++i) {
    grid_.Stamp(wide, {robots.sensed_x[i] * int64_t{1000}, robots.sensed_y[i] * int64_t{1000}});
  }
  grid_.Evaporate(wide, static_cast<float>(std::exp2(-200.0 / kTauMs)));
  for (const World::Phase phase :
       {World::Phase::kRoll, World::Phase::kGrid, World::Phase::kCollide, World::Phase::kCommit}) {
    if (!world_->Run(phase).ok()) {
      std::abort();
    }
  }
}

}  // namespace pheromone::lab::bench
