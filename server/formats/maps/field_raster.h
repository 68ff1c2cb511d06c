// A field as a raster, for display or a file: the content of each node in pheromone units; blocked
// nodes are unknown.
//
//   Result<Raster> trail = RasterOf(field, 1, now_ms);
//   SavePicture("trail.png", trail.value(), {.low = 0, .high = 1});
//
//   RasterOf(field, 1, now_ms, {.nodes_per_cell = 10});   // of a map of 20 000 x 20 000 nodes
//
// A Field is for its writer: not while another thread changes it. A FieldReader may be used
// meanwhile; neighbouring nodes may then differ in time by a few milliseconds.
#pragma once

#include <cstdint>
#include <optional>

#include "server/base/result.h"
#include "server/core/field/field.h"
#include "server/formats/maps/raster.h"

namespace pheromone::maps {

/// Between two nodes, both included.
struct NodeArea {
  field::NodeIndex first;
  field::NodeIndex last;
};

struct RasterExtent {
  std::optional<NodeArea> area;  ///< of the map; empty: all of it
  int32_t nodes_per_cell = 1;    ///< along each side of a cell of the raster, at least 1
};

/// The nodes of the map in the rectangle between two opposite corners, edges included. Empty if
/// there is none.
std::optional<NodeArea> NodesBetween(const field::MapGeometry& map, field::PointUm corner,
                                     field::PointUm opposite);

/// A cell is the square around its node; a cell of several nodes has the highest of their contents.
/// If that is 0 and at least one of them is blocked, it is NaN: neither a thin trail nor a thin
/// wall is lost by reducing the raster. Errors: no such type, a blend, an area that is not on the
/// map, or a raster that would have a SizeProblem.
Result<Raster> RasterOf(const field::Field& field, uint8_t type, uint64_t now_ms,
                        const RasterExtent& extent = {});

/// The same concurrently with the writer. `config` is a recent configuration of the field; its map,
/// pheromones and obstacles are used. If the law has changed since, the raster is invalid: try
/// again.
Result<Raster> RasterOf(const field::FieldReader& reader, const field::FieldConfig& config,
                        uint8_t type, uint64_t now_ms, const RasterExtent& extent = {});

/// The obstacles alone, as an occupancy grid (ros_map.h): kOccupied where one of the nodes is
/// blocked, kFree elsewhere. If a is even, a map that reads it again blocks the same nodes.
Result<Raster> ObstaclesOf(const field::FieldConfig& config, const RasterExtent& extent = {});

}  // namespace pheromone::maps
