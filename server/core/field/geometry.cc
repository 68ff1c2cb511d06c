#include "server/core/field/geometry.h"

#include <algorithm>

namespace pheromone::field {

bool MapGeometry::Contains(PointUm point) const {
  return point.x >= origin.x && point.x <= origin.x + width_um && point.y >= origin.y &&
         point.y <= origin.y + height_um;
}

NodeIndex MapGeometry::NearestNode(PointUm point) const {
  const auto nearest = [this](int64_t offset_um, int32_t count) {
    const int64_t index = FloorDiv(2 * offset_um + cell_um, 2 * cell_um);
    return static_cast<int32_t>(std::clamp<int64_t>(index, 0, count - 1));
  };
  return {nearest(point.x - origin.x, columns()), nearest(point.y - origin.y, rows())};
}

}  // namespace pheromone::field
