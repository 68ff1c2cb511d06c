// The nodes of an edit's shape as runs of columns, row by row: in time proportional to the nodes
// and to the rows that each segment of a stroke crosses, not to the bounding box. Computed in
// integers, exactly for points and radii within 2^50 um. Pure functions of their arguments, for any
// thread.
#pragma once

#include <cstdint>
#include <vector>

#include "server/base/result.h"
#include "server/core/field/edit.h"
#include "server/core/field/geometry.h"

namespace pheromone::field {

/// Nodes of one row, both ends included.
struct NodeRun {
  int32_t row = 0;
  int32_t first = 0;
  int32_t last = 0;
  bool operator==(const NodeRun&) const = default;
};

/// A tile of 8 x 8 nodes, as CellMap has them: node (column, row) is in tile (column / 8, row / 8).
struct TileIndex {
  int32_t column = 0;
  int32_t row = 0;
  bool operator==(const TileIndex&) const = default;
};

struct Raster {
  std::vector<NodeRun> runs;     ///< by row, then column; runs of a row do not touch
  int64_t node_count = 0;        ///< of all runs
  std::vector<TileIndex> tiles;  ///< that the runs touch, each once; by leaf (CellMap), row, column
  /// The work done: rows of segments, and steps to sort the runs of a row.
  int64_t steps = 0;
};

/// The nodes of the map in an edit's shape: those that are no further than the radius from one of a
/// stroke's segments, or between a rectangle's corners, edges included. Errors: a shape without the
/// points that it needs, or more than kMaxNodesOfEdit nodes; no more than those are ever in memory.
Result<Raster> RasterOf(const FieldEdit& edit, const MapGeometry& map);

}  // namespace pheromone::field
