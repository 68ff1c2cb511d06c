#include "server/core/engine/config_check.h"

#include <algorithm>
#include <set>
#include <string>

namespace pheromone::engine {
namespace {

bool IsWithin(int64_t value, int64_t least, int64_t most) {
  return value >= least && value <= most;
}

std::string Expected(const std::string& name, int64_t value, int64_t least, int64_t most) {
  return name + " is " + std::to_string(value) + ", expected " + std::to_string(least) + " to " +
         std::to_string(most);
}

Status CheckMap(const field::MapGeometry& map) {
  const int64_t shorter = std::min(map.width_um, map.height_um);
  const int64_t cells = std::max(map.width_um, map.height_um) / map.cell_um;
  if (map.cell_um > shorter) {
    return Error{Expected("map.cell_um", map.cell_um, 1, shorter)};
  }
  if (cells > field::MapGeometry::kMaxCells) {
    return Error{
        Expected("the number of cells along the map", cells, 1, field::MapGeometry::kMaxCells)};
  }
  return Ok();
}

bool IsGoodBlend(const field::PheromoneLaw& blend, const field::FieldConfig& config) {
  std::set<uint8_t> types;
  return std::all_of(blend.blend.begin(), blend.blend.end(), [&](const field::BlendPart& part) {
    const field::PheromoneLaw* law = config.FindLaw(part.type);
    return law != nullptr && !law->is_blend() && types.insert(part.type).second;
  });
}

Status CheckPheromones(const field::FieldConfig& config) {
  std::set<uint8_t> types;
  for (const field::PheromoneLaw& law : config.pheromones) {
    const std::string who = "pheromone type " + std::to_string(law.type) + ": ";
    if (!types.insert(law.type).second) {
      return Error{who + "defined twice"};
    }
    if (law.reach_um() > field::kMaxReachUm) {
      return Error{who + Expected("core_um + sigma_um", law.reach_um(), 1, field::kMaxReachUm)};
    }
    if (law.diffuses() && law.max_count > field::kMaxDiffusingCount) {
      return Error{who + "it diffuses, and " +
                   Expected("max_count", law.max_count, 1, field::kMaxDiffusingCount)};
    }
    if (!IsGoodBlend(law, config)) {
      return Error{who +
                   "a part of the blend does not exist, is a blend itself, or is there twice"};
    }
    const field::AntennaGeometry& antennas = config.antennas;
    const int64_t reach_um =
        law.reach_um() + antennas.distance_um / 2 + std::abs(antennas.forward_um);
    const int64_t reach_cells = reach_um / config.map.cell_um;
    if (reach_cells > field::kMaxReachCells) {
      return Error{who + Expected("the reach in cells", reach_cells, 0, field::kMaxReachCells)};
    }
  }
  return Ok();
}

Status CheckLaid(const field::FieldConfig& config) {
  const field::MapGeometry& map = config.map;
  for (const field::Path& path : config.paths) {
    const bool on_map = std::all_of(path.points.begin(), path.points.end(),
                                    [&map](field::PointUm point) { return map.Contains(point); });
    if (path.points.empty() || !on_map) {
      return Error{"a path without points, or with a point outside the map"};
    }
  }
  for (const field::InitialRaster& raster : config.initial_rasters) {
    const auto is_on_map = [&map](const field::InitialNode& it) {
      return IsWithin(it.node.column, 0, map.columns() - 1) &&
             IsWithin(it.node.row, 0, map.rows() - 1);
    };
    if (raster.nodes && !std::all_of(raster.nodes->begin(), raster.nodes->end(), is_on_map)) {
      return Error{"an initial raster with a node outside the map"};
    }
  }
  if (config.obstacles &&
      (config.obstacles->columns() != map.columns() || config.obstacles->rows() != map.rows())) {
    return Error{"obstacles for a map of another size"};
  }
  return Ok();
}

}  // namespace

// Each check relies on those before it.
Status CheckValues(const EngineConfig& config) {
  Status found = CheckFields(config, "");
  found = found.ok() ? CheckMap(config.field.map) : found;
  found = found.ok() ? CheckPheromones(config.field) : found;
  found = found.ok() ? CheckLaid(config.field) : found;
  return found.ok() ? CheckFrames(config.frames) : found;
}

}  // namespace pheromone::engine
