#include "server/formats/maps/field_raster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "server/formats/maps/ros_map.h"

namespace pheromone::maps {
namespace {

constexpr double kMicro = 1e6;

// A raster over part of a map, and the assignment of nodes to its cells.
struct Canvas {
  Raster raster;
  NodeArea area;
  int32_t nodes_per_cell = 1;

  // Null outside of the area.
  double* Find(field::NodeIndex node) {
    const bool inside = node.column >= area.first.column && node.column <= area.last.column &&
                        node.row >= area.first.row && node.row <= area.last.row;
    return inside ? &raster.At((node.column - area.first.column) / nodes_per_cell,
                               (node.row - area.first.row) / nodes_per_cell)
                  : nullptr;
  }
};

Result<Canvas> MakeCanvas(const field::MapGeometry& map, const RasterExtent& extent) {
  const field::NodeIndex corner{map.columns() - 1, map.rows() - 1};
  const NodeArea area = extent.area.value_or(NodeArea{{0, 0}, corner});
  const bool on_map = area.first.column >= 0 && area.first.row >= 0 &&
                      area.first.column <= area.last.column && area.first.row <= area.last.row &&
                      area.last.column <= corner.column && area.last.row <= corner.row;
  if (!on_map || extent.nodes_per_cell < 1) {
    return Error{"expected an area on the map and at least one node a cell"};
  }
  const auto cells = [&](int32_t first, int32_t last) {
    return static_cast<uint64_t>((last - first) / extent.nodes_per_cell) + 1;
  };
  const uint64_t columns = cells(area.first.column, area.last.column);
  const uint64_t rows = cells(area.first.row, area.last.row);
  const std::string problem = SizeProblem(columns, rows);
  if (!problem.empty()) {
    return Error{problem + "; use a smaller area or more nodes per cell"};
  }
  Canvas canvas{MakeRaster(static_cast<int32_t>(columns), static_cast<int32_t>(rows)), area,
                extent.nodes_per_cell};
  const field::PointUm node = map.PositionOf(area.first);
  const int64_t half_um = map.cell_um - map.cell_um / 2;
  canvas.raster.origin = {node.x - half_um, node.y - half_um};
  canvas.raster.cell_um = map.cell_um * extent.nodes_per_cell;
  return canvas;
}

template <typename Visit>
void ForEachBlocked(const field::FieldConfig& config, const Visit& visit) {
  if (config.obstacles) {
    config.obstacles->ForEach(visit);
  }
}

// `source` is a Field or a FieldReader.
template <typename Source>
Result<Raster> RasterOfSource(const Source& source, const field::FieldConfig& config, uint8_t type,
                              uint64_t now_ms, const RasterExtent& extent) {
  const field::PheromoneLaw* law = config.FindLaw(type);
  if (law == nullptr || law->is_blend()) {
    return Error{
        "pheromone type " + std::to_string(type) +
        (law == nullptr ? " is not configured" : " is a blend, which has no content of its own")};
  }
  PHEROMONE_TRY(Canvas canvas, MakeCanvas(config.map, extent));
  const double unit = static_cast<double>(law->quantum_micro) / field::kLevelsPerQuantum / kMicro;
  // First without the contents of blocked nodes, so that these are never shown.
  source.VisitLevels(type, now_ms, [&](field::NodeIndex node, uint32_t level) {
    double* const cell = canvas.Find(node);
    if (cell != nullptr && !(config.obstacles && config.obstacles->Blocked(node))) {
      *cell = std::max(*cell, level * unit);
    }
  });
  ForEachBlocked(config, [&](field::NodeIndex node) {
    double* const cell = canvas.Find(node);
    if (cell != nullptr && *cell == 0) {
      *cell = std::numeric_limits<double>::quiet_NaN();
    }
  });
  return std::move(canvas.raster);
}

}  // namespace

std::optional<NodeArea> NodesBetween(const field::MapGeometry& map, field::PointUm corner,
                                     field::PointUm opposite) {
  const auto up = [&](int64_t um) { return -field::FloorDiv(-um, map.cell_um); };
  const auto down = [&](int64_t um) { return field::FloorDiv(um, map.cell_um); };
  const auto [left, right] = std::minmax({corner.x - map.origin.x, opposite.x - map.origin.x});
  const auto [bottom, top] = std::minmax({corner.y - map.origin.y, opposite.y - map.origin.y});
  const int64_t first_column = std::max<int64_t>(up(left), 0);
  const int64_t last_column = std::min<int64_t>(down(right), map.columns() - 1);
  const int64_t first_row = std::max<int64_t>(up(bottom), 0);
  const int64_t last_row = std::min<int64_t>(down(top), map.rows() - 1);
  if (first_column > last_column || first_row > last_row) {
    return std::nullopt;
  }
  return NodeArea{{static_cast<int32_t>(first_column), static_cast<int32_t>(first_row)},
                  {static_cast<int32_t>(last_column), static_cast<int32_t>(last_row)}};
}

Result<Raster> RasterOf(const field::Field& field, uint8_t type, uint64_t now_ms,
                        const RasterExtent& extent) {
  return RasterOfSource(field, field.config(), type, now_ms, extent);
}

Result<Raster> RasterOf(const field::FieldReader& reader, const field::FieldConfig& config,
                        uint8_t type, uint64_t now_ms, const RasterExtent& extent) {
  return RasterOfSource(reader, config, type, now_ms, extent);
}

Result<Raster> ObstaclesOf(const field::FieldConfig& config, const RasterExtent& extent) {
  PHEROMONE_TRY(Canvas canvas, MakeCanvas(config.map, extent));
  ForEachBlocked(config, [&](field::NodeIndex node) {
    if (double* const cell = canvas.Find(node); cell != nullptr) {
      *cell = kOccupied;
    }
  });
  return std::move(canvas.raster);
}

}  // namespace pheromone::maps
