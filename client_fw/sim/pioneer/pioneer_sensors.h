// What a simulated Pioneer perceives of the obstacles around it: the readings of its sonars and the
// segments of its bumpers that are pressed.
//
//   const RangeFinder range = [](const PlanePose& from, double reach_m) { ... };   // metres
//   SonarRangeMm(model.sonars[3], robot_pose, range);
//   FindPressedBumpers(model, 5, robot_pose, range);
//
// A sonar's beam has no width. A bumper is pressed by what is within kBumperTravelMm of the disc
// that obstacles stop. Pure functions; any thread.
#pragma once

#include <functional>

#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/pioneer/pioneer_models.h"
#include "client_fw/sim/pioneer/pioneer_reports.h"

namespace pheromone::sim {

/// From a position to the nearest obstacle in the direction of its heading, in metres; anything
/// above `reach_m` if none is within that.
using RangeFinder = std::function<double(const PlanePose& from, double reach_m)>;

/// A sonar reports nothing nearer or farther than these, but one of them.
constexpr int kSonarNearMm = 100;
constexpr int kSonarReachMm = 5000;

/// An obstacle at this distance from the robot's disc presses a bumper.
constexpr int kBumperTravelMm = 10;

/// With an empty `range`: kSonarReachMm.
int SonarRangeMm(const SonarMount& sonar, const PlanePose& robot, const RangeFinder& range);

/// Of two rings of `segments` each, from 0 to 7, which share the halves of the circumference
/// equally. With an empty `range`: none.
PressedBumpers FindPressedBumpers(const PioneerModel& model, int segments, const PlanePose& robot,
                                  const RangeFinder& range);

}  // namespace pheromone::sim
