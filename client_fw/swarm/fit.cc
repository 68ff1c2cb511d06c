#include "client_fw/swarm/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "client_fw/core/steering/steering.h"

namespace pheromone::swarm {
namespace {

constexpr double kDelayS = 0.15;
constexpr double kNoLimit = std::numeric_limits<double>::infinity();

double NoticeS(const SpeedFit& fit) {
  return fit.period_ms / 1000.0 + kDelayS;
}

double ToStandM(const SpeedFit& fit) {
  const double speed_m_s = fit.speed_mm_s / 1000.0;
  const double brake_m = fit.drive.deceleration_m_s2 > 0
                             ? speed_m_s * speed_m_s / (2 * fit.drive.deceleration_m_s2)
                             : 0;
  return speed_m_s * NoticeS(fit) + brake_m;
}

// The root of the equation in fit.h.
double StandingSpeed(const SpeedFit& fit) {
  const double notice_s = NoticeS(fit);
  const double a = fit.drive.deceleration_m_s2;
  return a > 0 ? a * (std::sqrt(notice_s * notice_s + 2 * fit.reach_m / a) - notice_s)
               : fit.reach_m / notice_s;
}

double TurningSpeed(const SpeedFit& fit) {
  return fit.drive.turn_rad_s > 0 ? fit.drive.turn_rad_s * fit.drive.wheelbase_m : kNoLimit;
}

}  // namespace

DriveLimits LimitsOf(const sim::PioneerModel& model) {
  return {model.acceleration_mm_s2 / 1000.0, model.max_turn_deg_s * std::numbers::pi / 180,
          model.odometry_wheelbase_mm() / 1000};
}

DriveLimits LimitsOf(const sim::DriveConfig& drive) {
  return {drive.wheel_acceleration_m_s2, 0, drive.wheelbase_m};
}

int16_t FittingSpeed(const SpeedFit& fit) {
  const double most_mm_s = std::min({StandingSpeed(fit) * 1000, TurningSpeed(fit) * 1000,
                                     static_cast<double>(client::kMaxSpeedMmS)});
  return static_cast<int16_t>(std::floor(most_mm_s / 10) * 10);
}

std::optional<std::string> SpeedWarning(const SpeedFit& fit) {
  if (fit.speed_mm_s <= FittingSpeed(fit)) {
    return std::nullopt;
  }
  const double speed_m_s = fit.speed_mm_s / 1000.0;
  std::string what;
  if (speed_m_s > StandingSpeed(fit)) {
    what = fmt::format(
        "at {:g} m/s the robot needs {:.2f} m to stop after the trail ends, which is sensed within "
        "{:g} m",
        speed_m_s, ToStandM(fit), fit.reach_m);
  }
  if (speed_m_s > TurningSpeed(fit)) {
    what += fmt::format(
        "{}turning about a wheel at {:g} m/s takes {:.0f} degrees/s, and the robot "
        "does {:.0f}",
        what.empty() ? "" : "; ", speed_m_s,
        speed_m_s / fit.drive.wheelbase_m * 180 / std::numbers::pi,
        fit.drive.turn_rad_s * 180 / std::numbers::pi);
  }
  return fmt::format("{}; expected at most {:g} m/s", what, FittingSpeed(fit) / 1000.0);
}

}  // namespace pheromone::swarm
