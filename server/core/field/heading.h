// From a heading to a direction, in integers. One table, the same on every machine: a quarter of a
// sine wave in 16 384 steps, rounded to 1/16 384 (Q14), made at start-up by integer arithmetic
// alone. It is exact on the axes, and sine and cosine are equal at 45 degrees, so that a node lying
// exactly on a robot's axle line is found to lie exactly on it.
#pragma once

#include <cstdint>

namespace pheromone::field {

/// A unit vector, each component in 1/16 384.
struct DirectionQ14 {
  int32_t cos = 1 << 14;
  int32_t sin = 0;
};

/// The direction of a binary angle (65 536 a turn, counter-clockwise from +x).
DirectionQ14 DirectionOf(uint16_t heading);

}  // namespace pheromone::field
