#include "client_fw/lab/coverage.h"

#include <algorithm>

namespace pheromone::lab {

Coverage::Coverage(const field::FieldConfig& field, int64_t cell_um)
    : left_m_(static_cast<double>(field.map.origin.x) / 1e6),
      bottom_m_(static_cast<double>(field.map.origin.y) / 1e6),
      per_m_(1e6 / static_cast<double>(cell_um)),
      columns_(static_cast<size_t>(field.map.width_um / cell_um) + 1) {
  const field::MapGeometry& map = field.map;
  const size_t rows = static_cast<size_t>(map.height_um / cell_um) + 1;
  // A robot on the edge of the map, or rounded beyond it, is in a square more.
  last_step_.resize((rows + 1) * columns_ + 1);
  // Of each square, its nodes that are no obstacles.
  std::vector<int64_t> free(last_step_.size());
  const auto nodes = [&](size_t square, int64_t extent_um) {
    const auto up_to = [&](int64_t um) { return (um + map.cell_um - 1) / map.cell_um; };
    const int64_t begin_um = static_cast<int64_t>(square) * cell_um;
    return std::max<int64_t>(0, up_to(std::min(begin_um + cell_um, extent_um)) - up_to(begin_um));
  };
  for (size_t row = 0; row < rows; ++row) {
    for (size_t column = 0; column < columns_; ++column) {
      free[row * columns_ + column] = nodes(row, map.height_um) * nodes(column, map.width_um);
    }
  }
  if (field.obstacles) {
    field.obstacles->ForEach([&](field::NodeIndex node) {
      if (node.column * map.cell_um < map.width_um && node.row * map.cell_um < map.height_um) {
        --free[static_cast<size_t>(node.row * map.cell_um / cell_um) * columns_ +
               static_cast<size_t>(node.column * map.cell_um / cell_um)];
      }
    });
  }
  is_place_.resize(free.size());
  std::transform(free.begin(), free.end(), is_place_.begin(),
                 [](int64_t count) { return count > 0 ? uint8_t{1} : uint8_t{0}; });
}

Coverage::Share Coverage::At(uint64_t steps) const {
  uint64_t places = 0;
  uint64_t covered = 0;
  uint64_t most = 0;
  uint64_t squares = gap_squares_.load(std::memory_order_relaxed);
  for (size_t i = 0; i < is_place_.size(); ++i) {
    if (is_place_[i] != 0) {
      const uint64_t gap = steps - last_step_[i];
      ++places;
      covered += last_step_[i] != 0 ? 1u : 0u;
      most = std::max(most, gap);
      squares += gap * gap;
    }
  }
  if (places == 0 || steps == 0) {
    return {};
  }
  const double all = static_cast<double>(places);
  return {static_cast<double>(covered) / all,
          static_cast<double>(squares) / 2 / all / static_cast<double>(steps), most};
}

}  // namespace pheromone::lab
