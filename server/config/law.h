// The law of one pheromone: its [[pheromone]] table as the integers of server/core/field/law.h.
// Internal to this folder.
#pragma once

#include <optional>
#include <string>

#include "server/config/reader.h"
#include "server/core/field/config.h"

namespace pheromone::config {

/// How strongly it is sensed at a distance: `profile` and its lengths. `map` null: not known.
bool ReadSpread(const TableReader& table, const field::MapGeometry* map, field::PheromoneLaw* law);

/// How it becomes less: `evaporation` and its time.
bool ReadEvaporation(const TableReader& table, field::PheromoneLaw* law);

/// What a node holds: `quantum`, `maximum`.
bool ReadStrength(const TableReader& table, field::PheromoneLaw* law);

/// `diffusion`, if it is there; needs the evaporation and the quantum. `map` null: not known.
bool ReadDiffusion(const TableReader& table, const field::MapGeometry* map,
                   field::PheromoneLaw* law);

/// The most that an antenna senses of a pheromone, in units and whatever the sign: every node in
/// reach (ahead of the axle line, if directional) at its maximum, the antenna upon a node.
double StrongestSmell(const field::MapGeometry& map, const field::PheromoneLaw& law);

}  // namespace pheromone::config
