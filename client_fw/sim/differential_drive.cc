#include "client_fw/sim/differential_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pheromone::sim {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

// A heading in `steps` a turn, to the nearest one, modulo a turn.
uint16_t HeadingIn(double heading_rad, double steps) {
  const auto rounded = static_cast<int64_t>(std::llround(heading_rad / kTurn * steps));
  return static_cast<uint16_t>(rounded & (static_cast<int64_t>(steps) - 1));
}

int32_t Millimetres(double metres) {
  return static_cast<int32_t>(std::lround(metres * 1000));
}

}  // namespace

PlanePose MoveOnArc(const PlanePose& pose, double left_m, double right_m, double wheelbase_m) {
  const double way = (left_m + right_m) / 2;
  const double turn = (right_m - left_m) / wheelbase_m;
  // The chord of the arc: length * sin(turn / 2) / (turn / 2), in the direction halfway through.
  const double half = turn / 2;
  const double chord = std::abs(half) < 1e-9 ? way : way * std::sin(half) / half;
  const double direction = pose.heading_rad + half;
  return {pose.x_m + chord * std::cos(direction), pose.y_m + chord * std::sin(direction),
          pose.heading_rad + turn};
}

double WheelTarget(double mm_s, int quantum_mm_s, double max_m_s) {
  const double speed = quantum_mm_s > 0 ? std::round(mm_s / quantum_mm_s) * quantum_mm_s : mm_s;
  return std::clamp(speed / 1000, -max_m_s, max_m_s);
}

double RollWheel(double target_m_s, double limit_m_s2, double seconds, double* speed_m_s) {
  const double before = *speed_m_s;
  const double change = target_m_s - before;
  const double needed = limit_m_s2 > 0 ? std::abs(change) / limit_m_s2 : 0;
  const double ramp = std::min(needed, seconds);
  *speed_m_s = ramp < needed ? before + std::copysign(limit_m_s2 * ramp, change) : target_m_s;
  return (before + *speed_m_s) / 2 * ramp + target_m_s * (seconds - ramp);
}

DifferentialDrive::DifferentialDrive(const DriveConfig& config, const PlanePose& start)
    : config_(config), pose_(start) {}

void DifferentialDrive::Advance(double seconds) {
  const double left_m = Roll(&left_, seconds);
  const double right_m = Roll(&right_, seconds);
  const PlanePose pose = MoveOnArc(pose_, left_m, right_m, config_.wheelbase_m);
  stalled_ = (left_m != 0 || right_m != 0) && config_.blocked && config_.blocked(pose);
  if (stalled_) {
    left_.speed = 0;
    right_.speed = 0;
    return;
  }
  pose_ = pose;
  odometry_ = MoveOnArc(odometry_, left_m * config_.left_scale, right_m * config_.right_scale,
                        config_.wheelbase_m);
  travelled_m_ += std::abs(left_m + right_m) / 2;
}

bool DifferentialDrive::odometry(client::Odometry* odometry) const {
  odometry->x_mm = Millimetres(odometry_.x_m);
  odometry->y_mm = Millimetres(odometry_.y_m);
  odometry->heading = static_cast<uint16_t>(HeadingIn(odometry_.heading_rad, 4096) << 4);
  return true;
}

void DifferentialDrive::set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
  left_.target = TargetOf(left_mm_s);
  right_.target = TargetOf(right_mm_s);
}

}  // namespace pheromone::sim
