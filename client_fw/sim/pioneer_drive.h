// How a Pioneer moves: a speed and a turn rate that approach what was commanded under ARCOS's
// limits, the wheels that follow from them, the way on the ground, and what odometry makes of it.
//
//   PioneerDrive drive(body, errors, start, blocked);
//   drive.Tick({0.2, 0}, limits);             // one millisecond towards 0.2 m/s, straight on
//   drive.true_pose(); drive.odometry();
//
// Translation and rotation have limits and accelerations of their own, as ARCOS applies them to
// VEL2 too: v = (right + left) / 2, w = (right - left) / wheelbase. A wheel that would exceed what
// its motor can do makes the component that grows wait for the one that shrinks.
//
// The firmware holds the speeds that its encoders show. So the odometry is what was commanded, and
// errors appear in the true way: wheels of another size than the firmware believes, a wheelbase of
// another width, wheels that slip.
//
// Units: metres, radians, seconds; headings counter-clockwise and not reduced to a turn. Repeatable
// by seed. One thread.
#pragma once

#include <cstdint>
#include <random>

#include "client_fw/sim/differential_drive.h"

namespace pheromone::sim {

/// Speed of the robot's centre and turn rate.
struct Motion {
  double speed_m_s = 0;
  double turn_rad_s = 0;

  bool operator==(const Motion&) const = default;
};

/// All at least 0.
struct MotionLimits {
  double speed_m_s = 0;
  double turn_rad_s = 0;
  double acceleration_m_s2 = 0;
  double deceleration_m_s2 = 0;
  double turn_acceleration_rad_s2 = 0;
  double turn_deceleration_rad_s2 = 0;
};

struct PioneerBody {
  double wheelbase_m = 0;           ///< of the wheels on the ground
  double odometry_wheelbase_m = 0;  ///< of the firmware's sums
  double wheel_limit_m_s = 0;
};

/// What is wrong with a robot's odometry. |scale| <= 0.5, |heading_rad_per_m| <= 1, slip <= 1.
struct PioneerErrors {
  double scale = 0;              ///< odometry sees 1 + scale metres a metre driven straight
  double heading_rad_per_m = 0;  ///< and turns by this much a metre
  double slip = 0;               ///< a wheel loses up to this share of its way, new every 0.1 s
  uint64_t seed = 1;             ///< of the slip
};

/// Errors evenly drawn: scale and heading from plus or minus `most`'s, slip as in `most`.
PioneerErrors DrawPioneerErrors(const PioneerErrors& most, uint64_t seed);

class PioneerDrive {
 public:
  static constexpr double kTickS = 0.001;

  /// `blocked` may be empty.
  PioneerDrive(const PioneerBody& body, const PioneerErrors& errors, const PlanePose& start,
               Blocked blocked);

  /// Lets kTickS pass. A robot that is blocked stands, stalls and tries again with each tick.
  void Tick(const Motion& target, const MotionLimits& limits);

  /// Stands at once, whatever the deceleration.
  void Halt() { motion_ = {}; }

  /// Calls the present place and heading 0, 0, 0.
  void ResetOdometry() { odometry_ = {}; }

  const PlanePose& true_pose() const { return pose_; }
  const PlanePose& odometry() const { return odometry_; }
  const Motion& motion() const { return motion_; }
  /// Of the wheels, as encoders show them.
  double left_m_s() const { return LeftOf(motion_); }
  double right_m_s() const { return RightOf(motion_); }
  bool left_stalled() const { return left_stalled_; }
  bool right_stalled() const { return right_stalled_; }
  bool stalled() const { return left_stalled_ || right_stalled_; }

 private:
  double LeftOf(const Motion& motion) const;
  double RightOf(const Motion& motion) const;
  double FasterWheel(const Motion& motion) const;
  Motion Admissible(const Motion& target, const MotionLimits& limits) const;
  Motion Next(const Motion& goal, const MotionLimits& limits) const;
  void DrawSlip();

  PioneerBody body_;
  double left_scale_;  // metres seen a metre rolled
  double right_scale_;
  double slip_;
  Blocked blocked_;
  std::mt19937_64 random_;
  PlanePose pose_;
  PlanePose odometry_;
  Motion motion_;
  double left_grip_ = 1;  // the share of the way that is not lost
  double right_grip_ = 1;
  int ticks_until_slip_ = 0;
  bool left_stalled_ = false;
  bool right_stalled_ = false;
};

}  // namespace pheromone::sim
