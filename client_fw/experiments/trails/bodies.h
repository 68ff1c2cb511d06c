// Robots as obstacles to each other: discs of one size on the floor. A robot's sonars see the
// others, and it cannot drive into them.
//
//   Bodies bodies(/*radius_m=*/0.25);
//   const size_t self = bodies.Add(config.start);
//   config.range = bodies.RangeFrom(self);             // what its sonars see
//   config.drive.blocked = bodies.BlockedFor(self);    // what stops it
//   ... every millisecond: bodies.Move(self, robot.true_pose());
//   bodies.Nearest().gap_m;                            // negative: two of them overlap
//
// The functions share the bodies, which they may outlive. Robots move one after the other, so that
// one that touches another is stopped where they do; it may always drive away. Units: metres. One
// thread.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/pioneer/pioneer_sensors.h"

namespace pheromone::swarm {

class Bodies {
 public:
  explicit Bodies(double radius_m);

  /// Returns its number, counted from 0.
  size_t Add(const sim::PlanePose& pose);
  void Move(size_t body, const sim::PlanePose& pose);

  sim::RangeFinder RangeFrom(size_t self) const;
  sim::Blocked BlockedFor(size_t self) const;

  /// The two that are nearest to each other; the numbers are equal if there are not two.
  struct Pair {
    size_t a = 0;
    size_t b = 0;
    double gap_m = 0;  ///< between the rims
  };
  Pair Nearest() const;

 private:
  struct State {
    double radius_m;
    std::vector<sim::PlanePose> poses;
  };
  std::shared_ptr<State> state_;
};

}  // namespace pheromone::swarm
