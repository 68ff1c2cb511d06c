// Whether a robot's speed fits the trail that it follows.
//
//   if (auto warning = SpeedWarning({.speed_mm_s = 600, .reach_m = 0.5, .drive = LimitsOf(model)}))
//
// A trail that ends, or that the robot has left, is noticed with the next answer; then the robot
// brakes. Should it come to a stand where it can still sense the trail, then
//
//   K (T + t) + K^2 / (2 a) <= reach,      t = 0.15 s: a Pioneer's report, and an exchange
//
// T is the period, a the deceleration, reach = c + sigma that of the pheromone. And the law's
// sharpest turn is that about the inner wheel: K <= w d, w the largest turn rate, d the wheelbase;
// a robot that cannot turn so fast turns less than it steers. Pure; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/pioneer/pioneer_models.h"

namespace pheromone::swarm {

struct DriveLimits {
  double deceleration_m_s2 = 0;  ///< 0: no limit
  double turn_rad_s = 0;         ///< 0: no limit
  double wheelbase_m = 0;
};

DriveLimits LimitsOf(const sim::PioneerModel& model);
DriveLimits LimitsOf(const sim::DriveConfig& drive);

struct SpeedFit {
  int16_t speed_mm_s = 0;  ///< K
  uint16_t period_ms = 0;
  double reach_m = 0;
  DriveLimits drive;
};

/// The largest K that fits, rounded down to 10 mm/s.
int16_t FittingSpeed(const SpeedFit& fit);

/// Nothing if K fits; otherwise what does not, and the largest K that does.
std::optional<std::string> SpeedWarning(const SpeedFit& fit);

}  // namespace pheromone::swarm
