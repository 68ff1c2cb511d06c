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

/// In metres, with its edges.
struct AreaM {
  double left = 0;
  double bottom = 0;
  double right = 0;
  double top = 0;
};

/// The whole map.
AreaM AreaOf(const field::MapGeometry& map);

/// Whether a disc touches a square of a blocked node. Centre and radius in half micrometres, so
/// that half a cell is a whole number.
bool DiscTouches(const field::MapGeometry& map, const field::ObstacleMask& mask, int64_t x,
                 int64_t y, int64_t radius);

class Walls {
 public:
  /// It shares the mask of `field`, which need not outlive it.
  Walls(const field::FieldConfig& field, double most_radius_m);

  bool IsOnMap(double x_m, double y_m) const {
    return x_m >= map_m_.left && x_m <= map_m_.right && y_m >= map_m_.bottom && y_m <= map_m_.top;
  }

  /// Whether a disc on the map touches an obstacle; `radius_m` is at most the one given before.
  bool Touches(double x_m, double y_m, double radius_m) const {
    if (near_ == nullptr) {
      return false;
    }
    const field::PointUm centre{std::llround(x_m * 1e6), std::llround(y_m * 1e6)};
    return near_->Blocked(map_.NearestNode(centre)) &&
           DiscTouches(map_, *mask_, 2 * centre.x, 2 * centre.y, std::llround(radius_m * 2e6));
  }

 private:
  field::MapGeometry map_;
  AreaM map_m_;
  field::Shared<field::ObstacleMask> mask_;
  std::unique_ptr<field::ObstacleMask> near_;  // nodes that may be too near; null: none
};

}  // namespace pheromone::lab
