// Colours for numbers: viridis, from dark blue over green to yellow. It is perceptually uniform
// (equal steps look equal), readable in gray print and by the colour-blind.
//
//   Rgb colour = Viridis(0.5);   // {33, 145, 140}, halfway
//
// By Eric Firing, Nathaniel J. Smith and Stefan van der Walt for matplotlib 2.0 (2015), who gave it
// to the public domain (CC0).
#pragma once

#include <cstdint>

namespace pheromone::maps {

struct Rgb {
  uint8_t red = 0;
  uint8_t green = 0;
  uint8_t blue = 0;
  bool operator==(const Rgb&) const = default;
};

/// The colour of a value from 0 to 1, in 256 steps; values outside are clamped.
Rgb Viridis(double share);

}  // namespace pheromone::maps
