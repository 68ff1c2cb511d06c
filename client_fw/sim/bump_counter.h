// Counts how often a robot has run into something. A robot that pushes against a wall stalls
// repeatedly, moving by less than a millimetre in between: that is one bump, until it is stopped at
// another place.
//
//   BumpCounter bumps;
//   bumps.Look(drive.stalled(), drive.true_pose());      // every millisecond
//   bumps.count();
#pragma once

#include <cmath>
#include <cstdint>

#include "client_fw/sim/differential_drive.h"

namespace pheromone::sim {

class BumpCounter {
 public:
  /// At this distance from the last bump, a stall is a new one.
  static constexpr double kApartM = 0.02;

  void Look(bool stalled, const PlanePose& pose) {
    if (stalled &&
        (count_ == 0 || std::hypot(pose.x_m - last_.x_m, pose.y_m - last_.y_m) >= kApartM)) {
      last_ = pose;
      ++count_;
    }
  }
  uint32_t count() const { return count_; }

 private:
  PlanePose last_;
  uint32_t count_ = 0;
};

}  // namespace pheromone::sim
