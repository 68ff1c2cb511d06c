#include "client_fw/swarm/collision.h"

#include <cmath>
#include <cstdint>
#include <limits>

#include "client_fw/lab/walls.h"

namespace pheromone::swarm {
namespace {

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
    return lab::DiscTouches(map, *mask, std::llround(pose.x_m * 2e6), std::llround(pose.y_m * 2e6),
                            radius);
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
