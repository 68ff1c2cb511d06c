// From the units of the state and of the wire to the ones that people read.
#pragma once

#include <cstdint>
#include <numbers>

namespace pheromone {

inline double Metres(int64_t um) {
  return static_cast<double>(um) / 1e6;
}
/// A binary angle: 65536 are a whole turn.
inline double Degrees(uint16_t binary_angle) {
  return binary_angle * 360.0 / 65536;
}
inline double Radians(uint16_t binary_angle) {
  return binary_angle * 2 * std::numbers::pi / 65536;
}

}  // namespace pheromone
