#include "server/field/edit.h"

#include "server/field/raster.h"

namespace pheromone::field {

Result<std::vector<NodeIndex>> NodesOf(const FieldEdit& edit, const MapGeometry& map) {
  const Result<Raster> raster = RasterOf(edit, map);
  if (!raster.ok()) {
    return Error{raster.error()};
  }
  std::vector<NodeIndex> nodes;
  nodes.reserve(static_cast<size_t>(raster.value().node_count));
  for (const NodeRun run : raster.value().runs) {
    for (int32_t column = run.first; column <= run.last; ++column) {
      nodes.push_back({column, run.row});
    }
  }
  return nodes;
}

}  // namespace pheromone::field
