#include "server/field/edit.h"

#include <algorithm>
#include <string>

#include "server/field/wide_integer.h"

namespace pheromone::field {
namespace {

struct Box {
  PointUm low;
  PointUm high;
};

// Whether `p` is within `radius` of the straight line from `a` to `b`, exactly.
bool IsNear(PointUm p, PointUm a, PointUm b, int64_t radius) {
  const Int128 dx = b.x - a.x;
  const Int128 dy = b.y - a.y;
  const Int128 px = p.x - a.x;
  const Int128 py = p.y - a.y;
  const Int128 along = px * dx + py * dy;
  const Int128 length2 = dx * dx + dy * dy;
  const Int128 radius2 = Int128{radius} * radius;
  if (along <= 0 || length2 == 0) {
    return px * px + py * py <= radius2;
  }
  if (along >= length2) {
    const Int128 qx = p.x - b.x;
    const Int128 qy = p.y - b.y;
    return qx * qx + qy * qy <= radius2;
  }
  const Int128 across = px * dy - py * dx;  // distance * length
  return CompareToRoot(across, radius2, length2) <= 0;
}

Box BoxOf(const FieldEdit& edit, const MapGeometry& map) {
  Box box{map.origin, {map.origin.x + map.width_um, map.origin.y + map.height_um}};
  if (edit.shape != FieldEdit::Shape::kAll) {
    const auto by_x = [](PointUm a, PointUm b) { return a.x < b.x; };
    const auto by_y = [](PointUm a, PointUm b) { return a.y < b.y; };
    const auto [left, right] = std::minmax_element(edit.points.begin(), edit.points.end(), by_x);
    const auto [bottom, top] = std::minmax_element(edit.points.begin(), edit.points.end(), by_y);
    const int64_t margin = edit.shape == FieldEdit::Shape::kStroke ? edit.radius_um : 0;
    box = {{left->x - margin, bottom->y - margin}, {right->x + margin, top->y + margin}};
  }
  return box;
}

}  // namespace

Result<std::vector<NodeIndex>> NodesOf(const FieldEdit& edit, const MapGeometry& map) {
  const size_t least = edit.shape == FieldEdit::Shape::kRectangle ? 2
                       : edit.shape == FieldEdit::Shape::kStroke  ? 1
                                                                  : 0;
  if (edit.points.size() < least || edit.radius_um < 0) {
    return Error{"an edit without its points: a rectangle has two, a stroke at least one"};
  }
  const Box box = BoxOf(edit, map);
  const auto index = [&](int64_t offset, bool up, int32_t count) {
    const int64_t node = up ? -FloorDiv(-offset, map.cell_um) : FloorDiv(offset, map.cell_um);
    return static_cast<int32_t>(std::clamp<int64_t>(node, up ? 0 : -1, up ? count : count - 1));
  };
  const NodeIndex low{index(box.low.x - map.origin.x, true, map.columns()),
                      index(box.low.y - map.origin.y, true, map.rows())};
  const NodeIndex high{index(box.high.x - map.origin.x, false, map.columns()),
                       index(box.high.y - map.origin.y, false, map.rows())};
  std::vector<NodeIndex> nodes;
  if (low.column > high.column || low.row > high.row) {
    return nodes;
  }
  const int64_t area = int64_t{high.column - low.column + 1} * (high.row - low.row + 1);
  if (area > 4 * kMostNodesOfEdit) {
    return Error{"the edit spans " + std::to_string(area) + " nodes, expected at most " +
                 std::to_string(4 * kMostNodesOfEdit) + ": make it in parts"};
  }
  for (int32_t row = low.row; row <= high.row; ++row) {
    for (int32_t column = low.column; column <= high.column; ++column) {
      const PointUm at = map.PositionOf({column, row});
      bool inside = edit.shape != FieldEdit::Shape::kStroke;
      for (size_t i = 0; !inside && i < edit.points.size(); ++i) {
        inside = IsNear(at, edit.points[i > 0 ? i - 1 : 0], edit.points[i], edit.radius_um);
      }
      if (inside) {
        nodes.push_back({column, row});
      }
    }
  }
  if (static_cast<int64_t>(nodes.size()) > kMostNodesOfEdit) {
    return Error{"the edit touches " + std::to_string(nodes.size()) + " nodes, expected at most " +
                 std::to_string(kMostNodesOfEdit) + ": make it in parts"};
  }
  return nodes;
}

}  // namespace pheromone::field
