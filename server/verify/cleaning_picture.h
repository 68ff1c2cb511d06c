// A trace of cleaning robots as a picture: zones from top to bottom, time from left to right.
//
//   const std::string svg = TracePicture(limits, result);
#pragma once

#include <string>

#include "server/verify/cleaning_check.h"

namespace pheromone::verify {

/// Each robot's way through the zones, a bar for each cleaning, and crosses where one breaks down.
/// What repeats for ever is on a grey ground.
std::string TracePicture(const CleaningLimits& limits, const CleaningResult& result);

}  // namespace pheromone::verify
