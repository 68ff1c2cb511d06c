// What is measured: maps full of pheromone, and the poses from which robots ask. All of it follows
// from the numbers given, so that every variant, and every later run, meets the same.
//
// Cells are 0.1 m. Pheromone is the paper's: Z-shape with c = r / 4, directional, counters that
// lose one quantum every tau; sources hold 5-15 quanta and are up to ten tau old, so most of them
// are neither full nor gone. All times are whole ticks of tau / 16, which loses nothing in the
// short words of the scanned map.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/core/field/field.h"

namespace pheromone::field::bench {

constexpr int64_t kCellUm = 100'000;
constexpr int64_t kAntennaDistanceUm = 2 * kCellUm;
constexpr uint64_t kTickMs = 1'000;
constexpr uint64_t kTauMs = 16 * kTickMs;
constexpr uint16_t kMaxCount = 15;
constexpr int64_t kQuantumMicro = 10'000;
constexpr uint8_t kType = 1;

/// The moment at which the sources lie as described.
constexpr uint64_t kNowMs = 10'000 * kTickMs;

enum class Pattern {
  kUniform,  ///< each node with the same probability, deposited in random order
  kTrails,   ///< curved lines, one after the other
};

struct MapSpec {
  int32_t nodes = 0;  ///< N: the map has N x N nodes
  double density_percent = 0;
  Pattern pattern = Pattern::kUniform;
  bool operator==(const MapSpec&) const = default;
};

/// splitmix64 (Steele, Lea and Flood 2014): a hash for single numbers, and a generator.
uint64_t Mix(uint64_t x);

MapGeometry GeometryOf(int32_t nodes);
/// The pheromone with which the goals are stated, sensed over `reach_cells`.
PheromoneLaw LawOf(int reach_cells);
FieldConfig ConfigOf(int32_t nodes, const PheromoneLaw& law);

struct Source {
  NodeIndex node;
  uint16_t quanta = 0;
  uint64_t time_ms = 0;
};

/// In the order of their times.
std::vector<Source> SourcesOf(const MapSpec& spec);

/// Lays the sources on a map that has Deposit(PointUm, uint16_t quanta, uint64_t now_ms).
template <typename Map>
void Lay(const MapSpec& spec, Map* map) {
  const MapGeometry geometry = GeometryOf(spec.nodes);
  for (const Source& source : SourcesOf(spec)) {
    map->Deposit(geometry.PositionOf(source.node), source.quanta, source.time_ms);
  }
}

/// Uniform over the map and over headings. So many places exist that no two poses are alike.
std::vector<PoseUm> RandomPoses(int32_t nodes, size_t count, uint64_t seed);

/// Robots on their way at 0.5 m/s, one pose of each per frame of 1/30 s, frame after frame.
constexpr uint64_t kFramesPerSecond = 30;
std::vector<PoseUm> RobotPoses(int32_t nodes, int robots, size_t count, uint64_t seed);

}  // namespace pheromone::field::bench
