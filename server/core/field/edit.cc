#include "server/core/field/edit.h"

#include <algorithm>
#include <string>

#include "server/core/field/raster.h"

namespace pheromone::field {
namespace {

bool IsShort(const std::vector<PointUm>& points, int64_t radius_um) {
  if (radius_um > kMaxStrokeUm) {
    return false;
  }
  PointUm low = points.front();
  PointUm high = low;
  for (const PointUm point : points) {
    low = {std::min(low.x, point.x), std::min(low.y, point.y)};
    high = {std::max(high.x, point.x), std::max(high.y, point.y)};
  }
  return std::max(high.x - low.x, high.y - low.y) + 2 * radius_um <= kMaxStrokeUm;
}

}  // namespace

Status CheckShape(const FieldEdit& edit) {
  if (edit.shape > FieldEdit::Shape::kAll || edit.action > FieldEdit::Action::kErase) {
    return Error{"an edit of an unknown shape or action"};
  }
  const size_t least = edit.shape == FieldEdit::Shape::kRectangle ? 2
                       : edit.shape == FieldEdit::Shape::kStroke  ? 1
                                                                  : 0;
  if (edit.points.size() < least) {
    return Error{"an edit without its points: a rectangle has two, a stroke at least one"};
  }
  const auto is_far = [](PointUm point) {
    return point.x < -kMaxPointUm || point.x > kMaxPointUm || point.y < -kMaxPointUm ||
           point.y > kMaxPointUm;
  };
  if (std::any_of(edit.points.begin(), edit.points.end(), is_far)) {
    return Error{"an edit with a point further than 10^9 m from the map's origin of coordinates"};
  }
  if (edit.points.size() > kMaxStrokePoints) {
    return Error{"an edit of " + std::to_string(edit.points.size()) + " points, expected at most " +
                 std::to_string(kMaxStrokePoints) + ": make it in parts"};
  }
  if (edit.radius_um < 0) {
    return Error{"an edit with a radius of " + std::to_string(edit.radius_um) +
                 " um, expected 0 or more"};
  }
  const bool is_stroke = edit.shape == FieldEdit::Shape::kStroke;
  if (is_stroke && !edit.points.empty() && !IsShort(edit.points, edit.radius_um)) {
    return Error{"a stroke that spans more than 2 km: coordinates are in metres"};
  }
  return Ok();
}

Result<std::vector<NodeIndex>> NodesOf(const FieldEdit& edit, const MapGeometry& map) {
  PHEROMONE_TRY(const Raster raster, RasterOf(edit, map));
  std::vector<NodeIndex> nodes;
  nodes.reserve(static_cast<size_t>(raster.node_count));
  for (const NodeRun run : raster.runs) {
    for (int32_t column = run.first; column <= run.last; ++column) {
      nodes.push_back({column, run.row});
    }
  }
  return nodes;
}

}  // namespace pheromone::field
