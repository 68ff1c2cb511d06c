#include "server/formats/maps/resample.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <utility>
#include <vector>

namespace pheromone::maps {
namespace {

using Levels = std::map<field::NodeIndex, uint64_t>;  // sorted as a saved field is

Levels Move(const field::InitialRaster& print, const field::MapGeometry& from,
            const field::MapGeometry& to, uint64_t* nodes_outside) {
  Levels levels;
  for (const field::InitialNode& it : *print.nodes) {
    const field::PointUm at = from.PositionOf(it.node);
    if (!to.Contains(at)) {
      ++*nodes_outside;
      continue;
    }
    levels[to.NearestNode(at)] += it.level;
  }
  return levels;
}

}  // namespace

Result<Resampled> Resample(const SavedField& saved, const field::FieldConfig& config) {
  Resampled result;
  result.field.map = config.map;
  result.field.types = saved.types;
  for (const field::InitialRaster& print : saved.initial_rasters) {
    const field::PheromoneLaw* const law = config.FindLaw(print.type);
    const uint64_t maximum = law != nullptr ? law->max_level() : UINT32_MAX;
    std::vector<field::InitialNode> nodes;
    for (const auto& [node, level] : Move(print, saved.map, config.map, &result.nodes_outside)) {
      const uint64_t kept = std::min(level, maximum);
      result.levels_cut_off += level - kept;
      nodes.push_back({node, static_cast<uint32_t>(kept)});
    }
    if (!nodes.empty()) {
      result.field.initial_rasters.push_back({print.type, field::Shared(std::move(nodes))});
    }
  }
  PHEROMONE_TRY_STATUS(CheckFits(result.field, config));
  return result;
}

std::string InWords(const Resampled& moved) {
  char quanta[32];
  std::snprintf(quanta, sizeof quanta, "%g",
                static_cast<double>(moved.levels_cut_off) / field::kLevelsPerQuantum);
  return std::to_string(CountNodes(moved.field)) + " nodes with pheromone, " +
         std::to_string(moved.nodes_outside) + " dropped off the map, " + quanta +
         " quanta dropped above a maximum";
}

}  // namespace pheromone::maps
