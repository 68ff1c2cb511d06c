// A floor of 4 m x 3 m with six tags, and a camera above it that hangs askew; for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "client_fw/tracker/geometry.h"
#include "client_fw/tracker/rendering.h"

namespace pheromone::tracker {

constexpr double kRobotHeightM = 0.25;
constexpr double kRobotEdgeM = 0.12;
constexpr double kFloorEdgeM = 0.16;
constexpr int kFirstFloorTag = 500;

inline RenderedCamera CameraOfTheScene() {
  RenderedCamera camera;
  camera.lens = {.focal_px = 900, .centre_px = {652, 471}, .k1 = -0.15, .k2 = 0.02};
  camera.x_m = 1.9;
  camera.y_m = 1.3;
  camera.z_m = 3.3;
  camera.turn_rad = 0.05;
  camera.tilt_rad = 0.08;
  return camera;
}

inline std::vector<RenderedTag> FloorOfTheScene() {
  std::vector<RenderedTag> floor;
  for (const double x : {0.2, 2.0, 3.8}) {
    for (const double y : {0.15, 2.85}) {
      const auto number = static_cast<int>(floor.size());
      floor.push_back({kFirstFloorTag + number, x, y, 0.5 * number, kFloorEdgeM, 0});
    }
  }
  return floor;
}

inline std::vector<RenderedCable> CablesOfTheScene() {
  return {{0, 1, 4, 1.6, 0.008, 1.2}, {1.2, 0, 1.5, 3, 0.008, 0.8}};
}

/// Tags 1 to 12 at random, more than 0.4 m apart.
inline std::vector<RenderedTag> RobotsOfTheScene(std::mt19937* random) {
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<RenderedTag> robots;
  while (robots.size() < 12) {
    const RenderedTag robot{static_cast<int>(robots.size()) + 1,
                            0.3 + 3.4 * part(*random),
                            0.4 + 2.2 * part(*random),
                            6.283 * part(*random),
                            kRobotEdgeM,
                            kRobotHeightM};
    if (std::all_of(robots.begin(), robots.end(), [&](const RenderedTag& other) {
          return std::hypot(other.x_m - robot.x_m, other.y_m - robot.y_m) > 0.4;
        })) {
      robots.push_back(robot);
    }
  }
  return robots;
}

}  // namespace pheromone::tracker
