// The motion of a Pioneer: a speed and a turn rate that approach the commanded ones within ARCOS's
// limits, the resulting wheel speeds, the true path, and the odometry.
//
//   PioneerDrive drive(body, errors, start, blocked);
//   drive.Tick({0.2, 0}, limits);             // one millisecond towards 0.2 m/s, straight on
//   drive.true_pose(); drive.odometry();
//
// Translation and rotation have limits and accelerations of their own, as ARCOS applies them to
// VEL2 too: v = (right + left) / 2, w = (right - left) / wheelbase. If a wheel would exceed the
// limit of its motor, the component that grows waits for the one that shrinks.
//
// The firmware controls the speeds measured by its encoders. So the odometry follows the commands,
// and errors appear in the true path: wheels of another size than the firmware assumes, a wheelbase
// of another width, wheels that slip.
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

/// The errors of a robot's odometry. |scale| <= 0.5, |heading_rad_per_m| <= 1, slip <= 1.
struct PioneerErrors {
  double scale = 0;              ///< odometry measures 1 + scale metres per metre driven straight
  double heading_rad_per_m = 0;  ///< and a rotation of this much per metre
  double slip = 0;    ///< a wheel loses up to this share of its distance, drawn every 0.1 s
  uint64_t seed = 1;  ///< of the slip
};

/// Uniformly distributed errors: scale and heading within plus or minus those of `most`, slip as in
/// `most`.
PioneerErrors DrawPioneerErrors(const PioneerErrors& most, uint64_t seed);

class PioneerDrive {
 public:
  static constexpr double kTickS = 0.001;

  /// `blocked` may be empty.
  PioneerDrive(const PioneerBody& body, const PioneerErrors& errors, const PlanePose& start,
               Blocked blocked);

  /// Advances by kTickS. A blocked robot stalls and tries again with each tick.
  void Tick(const Motion& target, const MotionLimits& limits);

  /// Stops at once, regardless of the deceleration limit.
  void Halt() { motion_ = {}; }

  /// Resets the odometry to 0, 0, 0 at the present pose.
  void ResetOdometry() { odometry_ = {}; }

  const PlanePose& true_pose() const { return pose_; }
  const PlanePose& odometry() const { return odometry_; }
  const Motion& motion() const { return motion_; }
  /// Of the wheels, as encoders show them.
  double left_m_s() const { return LeftOf(motion_); }
  double right_m_s() const { return RightOf(motion_); }
  /// What the wheels have rolled since the start, as encoders count: forwards less backwards.
  double left_rolled_m() const { return left_rolled_m_; }
  double right_rolled_m() const { return right_rolled_m_; }
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
  double left_rolled_m_ = 0;
  double right_rolled_m_ = 0;
  double left_grip_ = 1;  // the share of the way that is not lost
  double right_grip_ = 1;
  int ticks_until_slip_ = 0;
  bool left_stalled_ = false;
  bool right_stalled_ = false;
};

}  // namespace pheromone::sim
