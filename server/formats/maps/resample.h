// Moves the contents of a map to a map of another origin, size or cell size.
//
//   Result<Resampled> moved = Resample(saved, config);   // config: with the new map
//
// The pheromone of each node goes to the nearest node of the new map. Values that coincide are
// added, up to the type's maximum, so that an antenna senses as much as before, within half a cell;
// on a finer map, the nodes between stay empty. Any thread.
#pragma once

#include <cstdint>
#include <string>

#include "server/base/result.h"
#include "server/core/field/config.h"
#include "server/formats/maps/field_file.h"

namespace pheromone::maps {

struct Resampled {
  SavedField field;
  uint64_t nodes_outside = 0;   ///< had content, but are not on the new map
  uint64_t levels_cut_off = 0;  ///< total above the types' maxima
};

/// "240 nodes with pheromone, 3 dropped off the map, 1.5 quanta dropped above a maximum"
std::string InWords(const Resampled& moved);

/// Errors: the configuration does not accept the result, see CheckFits.
Result<Resampled> Resample(const SavedField& saved, const field::FieldConfig& config);

}  // namespace pheromone::maps
