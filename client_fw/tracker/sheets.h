// What is printed: sheets with a tag each, and the board for the lens. SVG, in millimetres; A4 if
// it fits.
//
//   WriteFile("tag-7.svg", TagSheet(7, 0.12, "robot radio-a 7"));
//
// A ruler on each sheet shows whether the printer kept its size. Pure; any thread.
#pragma once

#include <string>
#include <string_view>

#include "client_fw/tracker/calibration.h"

namespace pheromone::tracker {

/// A tag whose black square has this edge; an arrow shows its heading.
std::string TagSheet(int tag, double edge_m, std::string_view label);

std::string BoardSheet(const Board& board);

}  // namespace pheromone::tracker
