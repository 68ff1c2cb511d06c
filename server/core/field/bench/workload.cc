#include "server/core/field/bench/workload.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace pheromone::field::bench {
namespace {

constexpr uint64_t kOldestTicks = 10 * kTauMs / kTickMs;

// A number in [0, 1) for each x.
double Fraction(uint64_t x) {
  return static_cast<double>(Mix(x) >> 11) * 0x1p-53;
}

uint16_t QuantaOf(uint64_t node) {
  return static_cast<uint16_t>(5 + Mix(~node) % 11);
}

uint64_t TimeOf(uint64_t done, uint64_t total) {
  return kNowMs - kTickMs * (kOldestTicks - done * kOldestTicks / total);
}

// Visits the nodes in steps of about the golden section of their number, so that neighbours are
// laid at different times and, in a map that makes tiles as they are needed, far apart in memory.
std::vector<Source> UniformSources(const MapSpec& spec) {
  const auto side = static_cast<uint64_t>(spec.nodes);
  const uint64_t total = side * side;
  auto step = static_cast<uint64_t>(static_cast<double>(total) * (std::numbers::phi - 1)) | 1;
  while (std::gcd(step, total) != 1) {
    step += 2;
  }
  std::vector<Source> sources;
  for (uint64_t i = 0, node = 0; i < total; ++i, node = (node + step) % total) {
    if (Fraction(node) * 100 < spec.density_percent) {
      sources.push_back({{static_cast<int32_t>(node % side), static_cast<int32_t>(node / side)},
                         QuantaOf(node),
                         TimeOf(i, total)});
    }
  }
  return sources;
}

std::vector<Source> TrailSources(const MapSpec& spec) {
  const auto side = static_cast<double>(spec.nodes - 1);
  const auto wanted =
      static_cast<uint64_t>(static_cast<double>(spec.nodes) * static_cast<double>(spec.nodes) *
                            spec.density_percent / 100);
  std::vector<Source> sources;
  sources.reserve(wanted);
  uint64_t random = 0;
  while (sources.size() < wanted) {
    double x = Fraction(++random) * side;
    double y = Fraction(++random) * side;
    double heading = Fraction(++random) * 2 * std::numbers::pi;
    const double turn = (Fraction(++random) - 0.5) * 0.04;  // radians a cell
    for (int length = 0; length < spec.nodes && sources.size() < wanted; ++length) {
      if (x < 0 || y < 0 || x > side || y > side) {
        break;
      }
      const NodeIndex node{static_cast<int32_t>(std::lround(x)),
                           static_cast<int32_t>(std::lround(y))};
      sources.push_back({node, QuantaOf(++random), TimeOf(sources.size(), wanted)});
      x += std::cos(heading);
      y += std::sin(heading);
      heading += turn;
    }
  }
  return sources;
}

}  // namespace

uint64_t Mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

MapGeometry GeometryOf(int32_t nodes) {
  MapGeometry map;
  map.width_um = (nodes - 1) * kCellUm;
  map.height_um = map.width_um;
  map.cell_um = kCellUm;
  return map;
}

PheromoneLaw LawOf(int reach_cells) {
  PheromoneLaw law;
  law.type = kType;
  law.name = "trail";
  law.core_um = reach_cells * kCellUm / 4;
  law.sigma_um = reach_cells * kCellUm - law.core_um;
  law.tau_ms = static_cast<int64_t>(kTauMs);
  law.quantum_micro = kQuantumMicro;
  law.max_count = kMaxCount;
  return law;
}

FieldConfig ConfigOf(int32_t nodes, const PheromoneLaw& law) {
  FieldConfig config;
  config.map = GeometryOf(nodes);
  config.antennas.distance_um = kAntennaDistanceUm;
  config.pheromones = {law};
  config.memory_bytes = uint64_t{1} << 30;
  return config;
}

std::vector<Source> SourcesOf(const MapSpec& spec) {
  return spec.pattern == Pattern::kUniform ? UniformSources(spec) : TrailSources(spec);
}

std::vector<PoseUm> RandomPoses(int32_t nodes, size_t count, uint64_t seed) {
  const auto places = static_cast<uint64_t>((nodes - 1) * kCellUm + 1);
  std::vector<PoseUm> poses(count);
  uint64_t random = Mix(seed);
  for (PoseUm& pose : poses) {
    pose.position = {static_cast<int64_t>(Mix(++random) % places),
                     static_cast<int64_t>(Mix(++random) % places)};
    pose.heading = static_cast<uint16_t>(Mix(++random));
  }
  return poses;
}

std::vector<PoseUm> RobotPoses(int32_t nodes, int robots, size_t count, uint64_t seed) {
  const auto side = static_cast<double>((nodes - 1) * kCellUm);
  constexpr double kStepUm = 0.5e6 / static_cast<double>(kFramesPerSecond);
  std::vector<PoseUm> poses = RandomPoses(nodes, static_cast<size_t>(robots), seed);
  poses.reserve(count);
  uint64_t random = Mix(~seed);
  while (poses.size() < count) {
    const PoseUm last = poses[poses.size() - static_cast<size_t>(robots)];
    const double angle = last.heading * 2 * std::numbers::pi / 65536;
    const double x = static_cast<double>(last.position.x) + kStepUm * std::cos(angle);
    const double y = static_cast<double>(last.position.y) + kStepUm * std::sin(angle);
    PoseUm next = last;
    if (x < 0 || y < 0 || x > side || y > side) {
      next.heading = static_cast<uint16_t>(Mix(++random));  // at the edge it turns on the spot
    } else {
      next.position = {std::llround(x), std::llround(y)};
      next.heading = static_cast<uint16_t>(last.heading + Mix(++random) % 1024 - 512);
    }
    poses.push_back(next);
  }
  return poses;
}

}  // namespace pheromone::field::bench
