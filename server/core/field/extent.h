// Where a map is, for messages about what is not on it.
#pragma once

#include <string>

#include "server/base/format.h"
#include "server/core/field/geometry.h"

namespace pheromone::field {

/// "the map: x from 0 to 10 m, y from 0 to 10 m".
inline std::string DescribeExtent(const MapGeometry& map) {
  const auto along = [](const char* axis, int64_t from_um, int64_t length_um) {
    const auto metres = [](int64_t um) { return FormatNumber(static_cast<double>(um) / 1e6); };
    return std::string(axis) + " from " + metres(from_um) + " to " + metres(from_um + length_um) +
           " m";
  };
  return "the map: " + along("x", map.origin.x, map.width_um) + ", " +
         along("y", map.origin.y, map.height_um);
}

}  // namespace pheromone::field
