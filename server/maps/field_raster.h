// A field as a raster, to be looked at or written to a file: the content of each node in pheromone
// units, and what obstacles block as unknown.
//
//   Result<Raster> trail = RasterOf(field, 1, now_ms);
//   SavePicture("trail.png", trail.value(), {.low = 0, .high = 1});
//
//   RasterOf(field, 1, now_ms, {.nodes_per_cell = 10});   // of a map of 20 000 x 20 000 nodes
//
// A Field is for its writer: not while another thread changes it. A FieldReader may look meanwhile;
// what it sees of neighbouring nodes may be some milliseconds apart.
#pragma once

#include <cstdint>
#include <optional>

#include "server/base/result.h"
#include "server/field/field.h"
#include "server/maps/raster.h"

namespace pheromone::maps {

/// Between two nodes, both included.
struct NodeArea {
  field::NodeIndex first;
  field::NodeIndex last;
};

struct RasterExtent {
  std::optional<NodeArea> area;  ///< of the map; nothing: all of it
  int32_t nodes_per_cell = 1;    ///< along each side of a cell of the raster, at least 1
};

/// The nodes whose positions lie in the rectangle between two opposite corners, edges included, as
/// far as they are on the map. Nothing if there is none.
std::optional<NodeArea> NodesBetween(const field::MapGeometry& map, field::PointUm corner,
                                     field::PointUm opposite);

/// A cell is the square around its node; one of several nodes has the strongest of their contents.
/// Where that is nothing and at least one of them is blocked, it is NaN: neither a thin trail nor a
/// thin wall is lost by making the raster smaller. Errors: no such type, a blend, an area that is
/// not on the map, or a raster that would have a SizeProblem.
Result<Raster> RasterOf(const field::Field& field, uint8_t type, uint64_t now_ms,
                        const RasterExtent& extent = {});

/// The same beside the writer. `config` is the field's of a moment ago; its map, pheromones and
/// obstacles count. If the law has changed since, the raster is worth nothing: look again.
Result<Raster> RasterOf(const field::FieldReader& reader, const field::FieldConfig& config,
                        uint8_t type, uint64_t now_ms, const RasterExtent& extent = {});

/// The obstacles alone, as an occupancy (ros_map.h): kOccupied where one of the nodes is blocked,
/// kFree elsewhere. If a is even, a map that reads it again blocks the same nodes.
Result<Raster> ObstaclesOf(const field::FieldConfig& config, const RasterExtent& extent = {});

}  // namespace pheromone::maps
