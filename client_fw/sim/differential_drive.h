// A differential-drive robot on a plane, and its odometry. It is a Drive for
// client_fw/core/robot.h, standing in for a Pioneer: wheel commands in steps of 20 mm/s, wheels
// that accelerate at a limit, positions reported in whole millimetres and headings in 4096 a turn.
//
// Units: metres, radians, seconds inside; the Drive's side in mm and binary angles. Headings
// counter-clockwise from +x. Within a step the distances rolled by the wheels are exact for the
// acceleration limit, and the robot moves on the arc of that curvature. An obstacle stops it at
// once: its wheels stall, and so the odometry does not change. No randomness; no threads.
#pragma once

#include <cstdint>
#include <functional>

#include "client_fw/boards/host/plane_pose.h"
#include "client_fw/core/base/angle.h"
#include "client_fw/core/steering/drive_status.h"
#include "client_fw/core/steering/steering.h"

namespace pheromone::sim {

using client::PlanePose;
using client::ToClientPose;

/// Whether an obstacle blocks the robot at this position.
using Blocked = std::function<bool(const PlanePose&)>;

struct DriveConfig {
  double wheelbase_m = 0.33;             ///< between the planes of the drive wheels
  double wheel_acceleration_m_s2 = 0.3;  ///< 0: no limit
  double max_wheel_speed_m_s = 1.2;
  int command_quantum_mm_s = 20;  ///< a Pioneer's VEL2; 0: none
  double left_scale = 1.0;        ///< odometry sees this many metres a metre of the left
  double right_scale = 1.0;       ///< and right wheel: drift
  Blocked blocked = {};           ///< an obstacle; none if empty
};

/// `pose` after its wheels rolled `left_m` and `right_m` along an arc.
PlanePose MoveOnArc(const PlanePose& pose, double left_m, double right_m, double wheelbase_m);

/// The speed that a wheel approaches when it is commanded `mm_s`: to the nearest of the steps of
/// `quantum_mm_s` (0: any), and limited.
double WheelTarget(double mm_s, int quantum_mm_s, double max_m_s);

/// The distance that a wheel rolls in `seconds`, while its speed approaches `target_m_s` by
/// `limit_m_s2` (0: at once). `*speed_m_s` becomes the speed at the end.
double RollWheel(double target_m_s, double limit_m_s2, double seconds, double* speed_m_s);

class DifferentialDrive {
 public:
  DifferentialDrive(const DriveConfig& config, const PlanePose& start);

  /// Advances by `seconds`. A blocked robot stalls and tries again with each call.
  void Advance(double seconds);

  // The Drive concept.
  bool odometry(client::Odometry* odometry) const;
  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s);
  /// It brakes as always. It has neither bumpers nor a battery.
  void emergency_stop() { set_wheel_speeds(0, 0); }
  const client::DriveStatus& status() const { return status_; }

  const PlanePose& true_pose() const { return pose_; }
  /// The present and the commanded wheel speeds (quantised and limited).
  double left_m_s() const { return left_.speed; }
  double right_m_s() const { return right_.speed; }
  double left_target_m_s() const { return left_.target; }
  double right_target_m_s() const { return right_.target; }
  /// It was blocked when it last tried to move.
  bool stalled() const { return stalled_; }
  /// The distance travelled by the robot's centre, forwards or backwards.
  double travelled_m() const { return travelled_m_; }

 private:
  struct Wheel {
    double speed = 0;
    double target = 0;
  };

  double TargetOf(int16_t mm_s) const {
    return WheelTarget(mm_s, config_.command_quantum_mm_s, config_.max_wheel_speed_m_s);
  }
  double Roll(Wheel* wheel, double seconds) const {
    return RollWheel(wheel->target, config_.wheel_acceleration_m_s2, seconds, &wheel->speed);
  }

  DriveConfig config_;
  PlanePose pose_;
  PlanePose odometry_;
  Wheel left_;
  Wheel right_;
  double travelled_m_ = 0;
  bool stalled_ = false;
  client::DriveStatus status_ = client::kNothingToTell;
};

}  // namespace pheromone::sim
