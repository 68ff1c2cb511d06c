// The cleaning swarm without a radio or wheels: the same decision, client_fw/core/tasks/cleaning.h,
// by robots that see and claim at once. What a gap would be if looking, asking and turning took no
// time: what the firmware's gaps are compared with.
//
//   ModelWorstGap(grid, /*robots=*/2, /*cycles=*/40, seed);    // 2.1 ideal cycles, say
//
// Cleaning takes 5 to 7 units of time, moving to the next zone 1 or 2, at random; a robot that sees
// only occupied zones looks again after 1. Robots start in different zones. Pure; any thread.
#pragma once

#include <cstdint>

#include "client_fw/experiments/cleaning/grid.h"

namespace pheromone::swarm {

/// The longest gap of all zones over `cycles` ideal cycles, in ideal cycles: zones for each robot
/// times a mean move and a mean cleaning. At most as many robots as zones.
double ModelWorstGap(const CleaningGrid& grid, int robots, int cycles, uint64_t seed);

}  // namespace pheromone::swarm
