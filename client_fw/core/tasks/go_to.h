// Wheel speeds towards a point. Integers only, so that every target computes the same; a pure
// function; any thread, any interrupt.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/steering/steering.h"

namespace pheromone {
namespace client {

/// Towards the point at (dx_mm, dy_mm) from the robot, in the axes of the map: a robot that looks
/// away from it by more than 45 degrees turns on the spot, each wheel at half of k_mm_s; else it
/// drives at k_mm_s and slows the wheel on the point's side. Requires 0 <= k_mm_s <= kMaxSpeedMmS.
WheelSpeeds SteerTo(int16_t dx_mm, int16_t dy_mm, BinaryAngle heading, int16_t k_mm_s);

}  // namespace client
}  // namespace pheromone
