// An operator's changes of the map: fill, brush, erase. Small enough to be an event of the log; the
// nodes that they change are determined in integers, exactly for points and radii within 2^50 um.
#pragma once

#include <cstdint>
#include <vector>

#include "server/base/fields.h"
#include "server/base/result.h"
#include "server/core/field/geometry.h"

namespace pheromone::field {

struct FieldEdit {
  enum class Shape : uint8_t {
    kRectangle,  ///< between two points, edges included
    kStroke,     ///< within `radius_um` of a line through the points; of one point: a disc
    kAll,        ///< the whole map
  };
  enum class Action : uint8_t {
    kSet,    ///< to the level
    kAdd,    ///< the level, up to the maximum
    kErase,  ///< to nothing
  };

  uint8_t type = 1;
  Shape shape = Shape::kRectangle;
  Action action = Action::kSet;
  uint32_t level = 0;  ///< in 1/64 quantum
  int64_t radius_um = 0;
  std::vector<PointUm> points;
  /// The ID of the last edit, if this one is the next part of it, such as of a stroke: they are
  /// undone together (edit_history.h). 0, or that of another edit: it is one of its own.
  uint64_t continues = 0;
  bool operator==(const FieldEdit&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("type", it.type);
    visit("shape", it.shape, UpTo(Shape::kAll));
    visit("action", it.action, UpTo(Action::kErase));
    visit("level", it.level);
    visit("radius_um", it.radius_um);
    visit("points", it.points);
    visit("continues", it.continues);
  }
};

/// The largest number of nodes that an edit may change; divide larger edits.
constexpr int64_t kMaxNodesOfEdit = int64_t{1} << 24;

/// Points within this distance of the origin of coordinates are computed exactly.
constexpr int64_t kMaxPointUm = 1'000'000'000'000'000;
/// Limits of a stroke: its extent, including the radius, and its number of points.
constexpr int64_t kMaxStrokeUm = 2'000'000'000;
constexpr size_t kMaxStrokePoints = 1024;

/// Checks an edit's shape and action, but not the number of its nodes.
Status CheckShape(const FieldEdit& edit);

/// The nodes of an edit's shape, row by row: those of RasterOf (raster.h), with its errors. Parts
/// beyond the map are left out.
Result<std::vector<NodeIndex>> NodesOf(const FieldEdit& edit, const MapGeometry& map);

}  // namespace pheromone::field
