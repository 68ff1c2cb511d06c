// Which robots are near: a uniform grid of their positions, rebuilt in each step.
//
//   DiscGrid grid(map, /*cell_m=*/0.4, robots);
//   grid.Build(x_m, y_m);
//   grid.VisitNear(x, y, 0.3, [&](size_t robot) { ... });   // all within 0.3 m of (x, y)
//
// Cells are larger than usual where there would be more than eight a robot: Build takes time in
// proportion to both.
// Build is for one thread; between two of them, any number may visit.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/core/field/geometry.h"

namespace pheromone::lab {

class DiscGrid {
 public:
  DiscGrid(const field::MapGeometry& map, double usual_cell_m, size_t robots)
      : left_m_(static_cast<double>(map.origin.x) / 1e6),
        bottom_m_(static_cast<double>(map.origin.y) / 1e6),
        next_(robots) {
    const double width_m = static_cast<double>(map.width_um) / 1e6;
    const double height_m = static_cast<double>(map.height_um) / 1e6;
    const double most_cells = std::max(4096.0, 8.0 * static_cast<double>(robots));
    const double cell_m = std::max(usual_cell_m, std::sqrt(width_m * height_m / most_cells));
    per_m_ = 1 / cell_m;
    columns_ = static_cast<int32_t>(width_m * per_m_) + 1;
    rows_ = static_cast<int32_t>(height_m * per_m_) + 1;
    first_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), kNone);
  }

  void Build(std::span<const double> x_m, std::span<const double> y_m) {
    std::fill(first_.begin(), first_.end(), kNone);
    for (size_t i = 0; i < x_m.size(); ++i) {
      int32_t& first = first_[CellOf(x_m[i], y_m[i])];
      next_[i] = first;
      first = static_cast<int32_t>(i);
    }
  }

  /// `visit(robot)` for all within `reach_m` of a position, and for others that are near.
  template <typename Visit>
  void VisitNear(double x_m, double y_m, double reach_m, Visit&& visit) const {
    const size_t first = CellOf(x_m - reach_m, y_m - reach_m);
    const size_t columns = ColumnOf(x_m + reach_m) - ColumnOf(x_m - reach_m);
    const size_t last = CellOf(x_m - reach_m, y_m + reach_m);
    for (size_t row = first; row <= last; row += static_cast<size_t>(columns_)) {
      for (size_t cell = row; cell <= row + columns; ++cell) {
        for (int32_t robot = first_[cell]; robot != kNone;
             robot = next_[static_cast<size_t>(robot)]) {
          visit(static_cast<size_t>(robot));
        }
      }
    }
  }

 private:
  static constexpr int32_t kNone = -1;

  static size_t Along(double cells, int32_t count) {
    return static_cast<size_t>(std::clamp(static_cast<int32_t>(cells), 0, count - 1));
  }
  size_t ColumnOf(double x_m) const { return Along((x_m - left_m_) * per_m_, columns_); }
  size_t CellOf(double x_m, double y_m) const {
    return Along((y_m - bottom_m_) * per_m_, rows_) * static_cast<size_t>(columns_) + ColumnOf(x_m);
  }

  double left_m_;
  double bottom_m_;
  double per_m_;
  int32_t columns_;
  int32_t rows_;
  std::vector<int32_t> first_;
  std::vector<int32_t> next_;
};

}  // namespace pheromone::lab
