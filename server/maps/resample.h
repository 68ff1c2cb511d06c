// What lies on one map, moved to a map of another origin, size or cell size.
//
//   Result<Resampled> moved = Resample(saved, config);   // config: with the new map
//
// The pheromone of each node goes to the nearest node of the new map. What meets on one adds up, to
// the type's maximum, so that an antenna smells as much as before, but for half a cell; on a finer
// map nodes between stay empty. Any thread.
#pragma once

#include <cstdint>
#include <string>

#include "server/base/result.h"
#include "server/field/config.h"
#include "server/maps/field_file.h"

namespace pheromone::maps {

struct Resampled {
  SavedField field;
  uint64_t nodes_outside = 0;   ///< held something, and do not lie on the new map
  uint64_t levels_cut_off = 0;  ///< above a type's maximum, in all
};

/// "240 nodes with pheromone, 3 dropped off the map, 1.5 quanta dropped above a maximum"
std::string InWords(const Resampled& moved);

/// Errors: the configuration does not take what comes of it, see CheckFits.
Result<Resampled> Resample(const SavedField& saved, const field::FieldConfig& config);

}  // namespace pheromone::maps
