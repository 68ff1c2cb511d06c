// What stands still: the obstacles of the map, as a disc meets them.
//
//   Walls walls(field_config, /*most_radius_m=*/0.25);
//   if (!walls.IsOnMap(x_m, y_m) || walls.Touches(x_m, y_m, 0.25)) ...
//
// Obstacles are the squares of the field's mask (server/core/field/obstacles.h), which may extend
// the configured obstacles by up to a cell. The edge of the map is a wall to a robot's centre. Most
// positions are far from any obstacle, which one bit tells. Immutable; any thread.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>

#include "server/core/field/config.h"

namespace pheromone::lab {

/// Whether a disc touches a square of a blocked node. Centre and radius in half micrometres, so
/// that half a cell is a whole number.
bool DiscTouches(const field::MapGeometry& map, const field::ObstacleMask& mask, int64_t x,
                 int64_t y, int64_t radius);

class Walls {
 public:
  /// It shares the mask of `field`, which need not outlive it.
  Walls(const field::FieldConfig& field, double most_radius_m);

  bool IsOnMap(double x_m, double y_m) const { return map_.Contains(PointOf(x_m, y_m)); }

  /// Whether a disc on the map touches an obstacle; `radius_m` is at most the one given before.
  bool Touches(double x_m, double y_m, double radius_m) const {
    const field::PointUm centre = PointOf(x_m, y_m);
    return near_ != nullptr && near_->Blocked(map_.NearestNode(centre)) &&
           DiscTouches(map_, *mask_, 2 * centre.x, 2 * centre.y, std::llround(radius_m * 2e6));
  }

 private:
  static field::PointUm PointOf(double x_m, double y_m) {
    return {std::llround(x_m * 1e6), std::llround(y_m * 1e6)};
  }

  field::MapGeometry map_;
  field::Shared<field::ObstacleMask> mask_;
  std::unique_ptr<field::ObstacleMask> near_;  // nodes that may be too near; null: none
};

}  // namespace pheromone::lab
