#include "client_fw/sim/pioneer/pioneer_drive.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pheromone::sim {
namespace {

constexpr int kSlipTicks = 100;
constexpr double kRounding = 1e-9;

// Uniformly from 0 up to 1. The distributions of the standard library differ between platforms;
// this one does not.
double Uniform(std::mt19937_64* random) {
  return static_cast<double>((*random)() >> 11) * 0x1p-53;
}

// One tick from `value` towards `goal`, slowing down and speeding up at different rates.
double Approach(double value, double goal, double faster, double slower) {
  if (value * goal < 0) {
    goal = 0;  // first to a stand
  }
  const double step = (std::abs(goal) > std::abs(value) ? faster : slower) * PioneerDrive::kTickS;
  return value + std::clamp(goal - value, -step, step);
}

}  // namespace

PioneerErrors DrawPioneerErrors(const PioneerErrors& most, uint64_t seed) {
  std::mt19937_64 random(seed);
  PioneerErrors errors = most;
  errors.scale *= 2 * Uniform(&random) - 1;
  errors.heading_rad_per_m *= 2 * Uniform(&random) - 1;
  errors.seed = random();
  return errors;
}

PioneerDrive::PioneerDrive(const PioneerBody& body, const PioneerErrors& errors,
                           const PlanePose& start, Blocked blocked)
    : body_(body),
      left_scale_(1 + errors.scale - errors.heading_rad_per_m * body.odometry_wheelbase_m / 2),
      right_scale_(1 + errors.scale + errors.heading_rad_per_m * body.odometry_wheelbase_m / 2),
      slip_(errors.slip),
      blocked_(std::move(blocked)),
      random_(errors.seed),
      pose_(start) {}

double PioneerDrive::LeftOf(const Motion& motion) const {
  return motion.speed_m_s - motion.turn_rad_s * body_.odometry_wheelbase_m / 2;
}

double PioneerDrive::RightOf(const Motion& motion) const {
  return motion.speed_m_s + motion.turn_rad_s * body_.odometry_wheelbase_m / 2;
}

double PioneerDrive::FasterWheel(const Motion& motion) const {
  return std::max(std::abs(LeftOf(motion)), std::abs(RightOf(motion)));
}

// The target under the limits, and slowed down along its curve to what the wheels can do.
Motion PioneerDrive::Admissible(const Motion& target, const MotionLimits& limits) const {
  Motion motion = {std::clamp(target.speed_m_s, -limits.speed_m_s, limits.speed_m_s),
                   std::clamp(target.turn_rad_s, -limits.turn_rad_s, limits.turn_rad_s)};
  const double wheel = FasterWheel(motion);
  if (wheel > body_.wheel_limit_m_s) {
    motion.speed_m_s *= body_.wheel_limit_m_s / wheel;
    motion.turn_rad_s *= body_.wheel_limit_m_s / wheel;
  }
  return motion;
}

Motion PioneerDrive::Next(const Motion& goal, const MotionLimits& limits) const {
  Motion next = {Approach(motion_.speed_m_s, goal.speed_m_s, limits.acceleration_m_s2,
                          limits.deceleration_m_s2),
                 Approach(motion_.turn_rad_s, goal.turn_rad_s, limits.turn_acceleration_rad_s2,
                          limits.turn_deceleration_rad_s2)};
  if (FasterWheel(next) > body_.wheel_limit_m_s + kRounding) {
    // Each ramp by itself may lead through motions that the wheels cannot perform, although both
    // ends are feasible. Then the component that shrinks goes first; as the goal is feasible, one
    // does shrink.
    if (std::abs(next.speed_m_s) > std::abs(motion_.speed_m_s)) {
      next.speed_m_s = motion_.speed_m_s;
    }
    if (std::abs(next.turn_rad_s) > std::abs(motion_.turn_rad_s)) {
      next.turn_rad_s = motion_.turn_rad_s;
    }
  }
  return next;
}

void PioneerDrive::DrawSlip() {
  if (slip_ > 0 && ticks_until_slip_-- == 0) {
    ticks_until_slip_ = kSlipTicks - 1;
    left_grip_ = 1 - slip_ * Uniform(&random_);
    right_grip_ = 1 - slip_ * Uniform(&random_);
  }
}

void PioneerDrive::Tick(const Motion& target, const MotionLimits& limits) {
  DrawSlip();
  const Motion next = Next(Admissible(target, limits), limits);
  const double left_m = (LeftOf(motion_) + LeftOf(next)) / 2 * kTickS;
  const double right_m = (RightOf(motion_) + RightOf(next)) / 2 * kTickS;
  const PlanePose pose = MoveOnArc(pose_, left_m / left_scale_ * left_grip_,
                                   right_m / right_scale_ * right_grip_, body_.wheelbase_m);
  const bool moves = left_m != 0 || right_m != 0;
  const bool stands = moves && blocked_ && blocked_(pose);
  left_stalled_ = stands && left_m != 0;
  right_stalled_ = stands && right_m != 0;
  if (stands) {
    motion_ = {};
    return;
  }
  motion_ = next;
  pose_ = pose;
  left_rolled_m_ += left_m;
  right_rolled_m_ += right_m;
  odometry_ = MoveOnArc(odometry_, left_m, right_m, body_.odometry_wheelbase_m);
}

}  // namespace pheromone::sim
