// Compares configurations: everything, or what HELLO tells robots.
#pragma once

#include <cstdint>

#include "server/core/engine/event.h"

namespace pheromone::engine {

/// Covers every field of the configuration, including the content of initial rasters and obstacles.
/// In time proportional to its size.
uint64_t HashConfig(const EngineConfig& config);

/// HELLO's type mask: bit t is set if type t exists, as a pheromone or as a blend.
uint16_t TypeMaskOf(const field::FieldConfig& config);

/// Whether HELLO answers are the same for both; if not, clients must repeat HELLO, and the change
/// begins an epoch. Frames do not count: nothing that a robot was told becomes wrong, and a request
/// in flight under an older frame means the same place on the floor, which the new frame finds
/// better.
bool SameHello(const EngineConfig& a, const EngineConfig& b);

}  // namespace pheromone::engine
