// What two configurations have in common: everything, or what robots were told of them.
#pragma once

#include <cstdint>

#include "server/engine/event.h"

namespace pheromone::engine {

/// Covers every field of the configuration, the content of prints and obstacles included. In the
/// time that it takes to read it all.
uint64_t HashConfig(const EngineConfig& config);

/// HELLO's type mask: bit t is set if type t exists, as a pheromone or as a blend.
uint16_t TypeMaskOf(const field::FieldConfig& config);

/// Whether HELLO tells the same of both; if not, clients must ask again, and the change begins an
/// epoch. Frames are not in it: a robot goes on counting as it did, and nothing it was told is
/// wrong. A request on its way under an older frame means the same place on the floor, which the
/// new frame finds better.
bool SameHello(const EngineConfig& a, const EngineConfig& b);

}  // namespace pheromone::engine
