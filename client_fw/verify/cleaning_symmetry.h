// The ways to lay a floor of zones onto itself: what is true of a state is true of it turned, where
// nothing depends on the place.
//
//   const std::vector<ZoneMap> maps = FloorSymmetries(GridNeighbours(3, 3), rates, 0);  // 8
//
// Zones go where their neighbours go with them, to zones of the same rate, closed ones to closed
// ones. Pure; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/verify/cleaning_world.h"

namespace pheromone::verify {

/// Where each zone goes.
using ZoneMap = std::array<uint8_t, kMaxZones>;

/// Each to itself.
ZoneMap LeaveAsItIs();

/// More are of no use: each state is turned in all of them.
constexpr size_t kMaxSymmetries = 16;

/// All of them, the first of which leaves the floor as it is; if there are more than
/// kMaxSymmetries, only that one. Empty rates: all the same.
std::vector<ZoneMap> FloorSymmetries(const CleaningNeighbours& floor,
                                     const std::vector<int>& rates_percent, uint64_t closed);

}  // namespace pheromone::verify
