#include "client_fw/lab/walls.h"

#include <algorithm>
#include <cstdlib>

namespace pheromone::lab {

AreaM AreaOf(const field::MapGeometry& map) {
  const auto metres = [](int64_t um) { return static_cast<double>(um) / 1e6; };
  return {metres(map.origin.x), metres(map.origin.y), metres(map.origin.x + map.width_um),
          metres(map.origin.y + map.height_um)};
}

bool DiscTouches(const field::MapGeometry& map, const field::ObstacleMask& mask, int64_t x,
                 int64_t y, int64_t radius) {
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

Walls::Walls(const field::FieldConfig& field, double most_radius_m)
    : map_(field.map), map_m_(AreaOf(field.map)), mask_(field.obstacles) {
  if (!mask_ || mask_->empty()) {
    return;
  }
  near_ = std::make_unique<field::ObstacleMask>(mask_->columns(), mask_->rows());
  // A disc in the cell of a node reaches a square so many nodes from it: half a cell to the cell's
  // side, the radius, and half a cell to the square's node.
  const int32_t reach = static_cast<int32_t>(std::llround(most_radius_m * 1e6) / map_.cell_um) + 2;
  mask_->ForEach([&](field::NodeIndex node) {
    for (int32_t row = node.row - reach; row <= node.row + reach; ++row) {
      near_->BlockRow(row, node.column - reach, node.column + reach);
    }
  });
}

}  // namespace pheromone::lab
