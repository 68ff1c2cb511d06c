#include "client_fw/swarm/collision.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace pheromone::swarm {
namespace {

// The disc and the squares in half micrometres, so that half a cell is a whole number.
bool Touches(const field::MapGeometry& map, const field::ObstacleMask& mask, int64_t x, int64_t y,
             int64_t radius) {
  const int64_t half_side = map.cell_um;
  const int64_t cell = 2 * map.cell_um;
  // Columns and rows whose squares reach to the disc's sides, if only to touch them.
  const auto from = [&](int64_t at, int64_t origin) {
    return static_cast<int32_t>(field::FloorDiv(at - radius - 2 * origin + half_side - 1, cell));
  };
  const auto to = [&](int64_t at, int64_t origin) {
    return static_cast<int32_t>(field::FloorDiv(at + radius - 2 * origin + half_side, cell));
  };
  const auto beyond_side = [&](int64_t at, int64_t centre) {
    return std::max<int64_t>(0, std::abs(at - centre) - half_side);
  };
  for (int32_t row = from(y, map.origin.y); row <= to(y, map.origin.y); ++row) {
    for (int32_t column = from(x, map.origin.x); column <= to(x, map.origin.x); ++column) {
      if (!mask.Blocked({column, row})) {
        continue;
      }
      const field::PointUm centre = map.PositionOf({column, row});
      const int64_t dx = beyond_side(x, 2 * centre.x);
      const int64_t dy = beyond_side(y, 2 * centre.y);
      if (dx * dx + dy * dy <= radius * radius) {
        return true;
      }
    }
  }
  return false;
}

// From square to square along the ray (Amanatides and Woo 1987), in cells: column c spans x from c
// to c + 1.
double CastRay(const field::MapGeometry& map, const field::ObstacleMask& mask,
               const sim::PlanePose& from, double reach_m) {
  const double cell_m = static_cast<double>(map.cell_um) / 1e6;
  struct Axis {
    double at = 0;
    double direction = 0;
    int32_t index = static_cast<int32_t>(std::floor(at));
    int32_t step = direction > 0 ? 1 : -1;
    double per_cell =
        direction == 0 ? std::numeric_limits<double>::infinity() : 1 / std::abs(direction);
    double next =
        direction == 0 ? per_cell : (direction > 0 ? index + 1 - at : at - index) * per_cell;
  };
  Axis x{(from.x_m - static_cast<double>(map.origin.x) / 1e6) / cell_m + 0.5,
         std::cos(from.heading_rad)};
  Axis y{(from.y_m - static_cast<double>(map.origin.y) / 1e6) / cell_m + 0.5,
         std::sin(from.heading_rad)};
  for (double travelled = 0; travelled * cell_m <= reach_m;) {
    if (mask.Blocked({x.index, y.index})) {
      return travelled * cell_m;
    }
    Axis& axis = x.next < y.next ? x : y;
    travelled = axis.next;
    axis.next += axis.per_cell;
    axis.index += axis.step;
  }
  return std::numeric_limits<double>::infinity();
}

bool HasObstacles(const field::FieldConfig& field) {
  return field.obstacles && !field.obstacles->empty();
}

}  // namespace

sim::Blocked BlockedBy(const field::FieldConfig& field, double radius_m) {
  if (!HasObstacles(field)) {
    return {};
  }
  return [map = field.map, mask = field.obstacles,
          radius = std::llround(radius_m * 2e6)](const sim::PlanePose& pose) {
    return Touches(map, *mask, std::llround(pose.x_m * 2e6), std::llround(pose.y_m * 2e6), radius);
  };
}

sim::RangeFinder RangeTo(const field::FieldConfig& field) {
  if (!HasObstacles(field)) {
    return {};
  }
  return [map = field.map, mask = field.obstacles](const sim::PlanePose& from, double reach_m) {
    return CastRay(map, *mask, from, reach_m);
  };
}

}  // namespace pheromone::swarm
