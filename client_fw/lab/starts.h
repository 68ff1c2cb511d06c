// Places for robots to start at: drawn at random, none over another or in a wall.
//
//   StartPlacer placer(field_config, /*most_radius_m=*/0.25, seed);
//   placer.Take({1, 2, 0}, 0.25);                       // a robot that has its place
//   std::optional<sim::PlanePose> start = placer.Find({0, 0, 5, 5}, 0.25);
//
// The same calls give the same places. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "client_fw/lab/walls.h"
#include "client_fw/sim/differential_drive.h"
#include "server/core/field/config.h"

namespace pheromone::lab {

class StartPlacer {
 public:
  /// So many places are tried for a robot: where nine of ten are taken, it still finds one but for
  /// one time in a billion.
  static constexpr uint64_t kMaxTries = 200;

  StartPlacer(const field::FieldConfig& field, double most_radius_m, uint64_t seed)
      : walls_(field, most_radius_m), cell_m_(2 * most_radius_m + 0.01), seed_(seed) {}

  void Take(const sim::PlanePose& pose, double radius_m);

  /// A free place, with any heading, which is then taken; nothing after kMaxTries.
  std::optional<sim::PlanePose> Find(const AreaM& area, double radius_m);

 private:
  struct Disc {
    double x_m;
    double y_m;
    double radius_m;
  };

  int64_t CellAlong(double at_m) const { return static_cast<int64_t>(std::floor(at_m / cell_m_)); }
  static uint64_t KeyOf(int64_t column, int64_t row) {
    return static_cast<uint64_t>(column) << 32 ^ (static_cast<uint64_t>(row) & UINT32_MAX);
  }
  bool IsFree(double x_m, double y_m, double radius_m) const;

  Walls walls_;
  double cell_m_;
  uint64_t seed_;
  uint64_t drawn_ = 0;  // robots
  std::unordered_map<uint64_t, std::vector<Disc>> cells_;
};

}  // namespace pheromone::lab
