// What is ahead limits how fast a robot drives towards it.
//
//   wheels = LimitByRange(wheels, front_mm);
//
// v = (v_L + v_R)/2 is limited to (front_mm - kFrontStandMm)/(1 s): it comes to rest kFrontStandMm
// before a wall, without ever braking harder than 1/s of its speed. The turn rate stays as it is,
// so that a robot that stands before a wall can still turn away from it. Backwards, and beyond the
// range of a sonar (kNoRange), nothing changes.
//
// Pure; mm, mm/s.
#pragma once

#include <stdint.h>

#include "client_fw/core/steering/steering.h"

namespace pheromone {
namespace client {

constexpr uint16_t kFrontStandMm = 250;

inline WheelSpeeds LimitByRange(WheelSpeeds wheels, uint16_t front_mm) {
  const uint16_t limit =
      front_mm > kFrontStandMm ? static_cast<uint16_t>(front_mm - kFrontStandMm) : uint16_t{0};
  const int16_t speed = static_cast<int16_t>((wheels.left_mm_s + wheels.right_mm_s) / 2);
  if (speed > 0 && static_cast<uint16_t>(speed) > limit) {
    const int16_t excess = static_cast<int16_t>(speed - static_cast<int16_t>(limit));
    wheels.left_mm_s = static_cast<int16_t>(wheels.left_mm_s - excess);
    wheels.right_mm_s = static_cast<int16_t>(wheels.right_mm_s - excess);
  }
  return wheels;
}

}  // namespace client
}  // namespace pheromone
