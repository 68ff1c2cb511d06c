#include "client_fw/sim/pioneer/pioneer_sensors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pheromone::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
// So many rays look for what touches a ring; at the rim of the largest robot they are closer to
// each other than the bumpers' travel, so that no corner slips between two.
constexpr int kRays = 360;

}  // namespace

int SonarRangeMm(const SonarMount& sonar, const PlanePose& robot, const RangeFinder& range) {
  if (!range) {
    return kSonarReachMm;
  }
  const double forward_m = sonar.x_mm / 1000.0;
  const double left_m = sonar.y_mm / 1000.0;
  const double cosine = std::cos(robot.heading_rad);
  const double sine = std::sin(robot.heading_rad);
  const double range_m = range({robot.x_m + forward_m * cosine - left_m * sine,
                                robot.y_m + forward_m * sine + left_m * cosine,
                                robot.heading_rad + sonar.heading_deg * kDegree},
                               kSonarReachMm / 1000.0);
  return static_cast<int>(
      std::lround(std::clamp<double>(range_m * 1000, kSonarNearMm, kSonarReachMm)));
}

PressedBumpers FindPressedBumpers(const PioneerModel& model, int segments, const PlanePose& robot,
                                  const RangeFinder& range) {
  PressedBumpers pressed;
  if (!range || segments == 0) {
    return pressed;
  }
  const double touching_m = (model.radius_mm + kBumperTravelMm) / 1000.0;
  for (int ray = 0; ray < kRays; ++ray) {
    const double clockwise_deg = (ray + 0.5) * 360 / kRays;
    const double bearing_rad = (90 - clockwise_deg) * kDegree;  // from the left around the front
    if (range({robot.x_m, robot.y_m, robot.heading_rad + bearing_rad}, touching_m) <= touching_m) {
      const bool front = clockwise_deg < 180;
      const double in_ring_deg = front ? clockwise_deg : clockwise_deg - 180;
      const int segment = static_cast<int>(in_ring_deg / 180 * segments);
      (front ? pressed.front : pressed.rear) |= static_cast<uint8_t>(1 << segment);
    }
  }
  return pressed;
}

}  // namespace pheromone::sim
