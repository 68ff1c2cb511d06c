// A pose in a plane, in metres and radians as hosts count, and as robots report it.
//
//   ToClientPose({1.2345, -0.5, std::numbers::pi / 2});    // {1235, -500, 16384}
//
// A function of its argument; any thread.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "client_fw/core/base/angle.h"

namespace pheromone::client {

/// Also a transform between two frames.
struct PlanePose {
  double x_m = 0;
  double y_m = 0;
  double heading_rad = 0;  ///< counter-clockwise from +x, not reduced to a turn
};

/// The largest absolute coordinate that the protocol can tell.
constexpr double kMaxCoordinateM = kMaxCoordinateMm / 1000.0;

/// Whether it is finite, and no further away than kMaxCoordinateM.
inline bool IsReportable(const PlanePose& pose) {
  return std::isfinite(pose.heading_rad) && std::abs(pose.x_m) <= kMaxCoordinateM &&
         std::abs(pose.y_m) <= kMaxCoordinateM;
}

/// To the nearest millimetre and binary angle, if IsReportable.
inline Pose ToClientPose(const PlanePose& pose) {
  constexpr double kTurnRad = 2 * std::numbers::pi;
  const auto angle = static_cast<int64_t>(
      std::llround(std::remainder(pose.heading_rad, kTurnRad) * 65'536 / kTurnRad));
  return {static_cast<int32_t>(std::lround(pose.x_m * 1000)),
          static_cast<int32_t>(std::lround(pose.y_m * 1000)),
          static_cast<BinaryAngle>(angle & 0xFFFF)};
}

}  // namespace pheromone::client
