// A group of robots: those that differ only in their start poses, and what they are like.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client_fw/lab/behaviour.h"
#include "client_fw/sim/differential_drive.h"

namespace pheromone::lab {

/// As sim::DriveConfig has them.
struct Wheels {
  double wheelbase_m = 0.33;
  double acceleration_m_s2 = 0.3;  ///< 0: no limit
  double max_speed_m_s = 1.2;
  int quantum_mm_s = 20;  ///< of commands; 0: none
};

/// How far what the wheels tell is from how the robot moves. All 0: not at all.
struct OdometryErrors {
  double bias = 0;   ///< of a wheel's length, normal with this deviation, drawn once a wheel
  double noise = 0;  ///< of the way of a step, normal with this deviation
  double slip = 0;   ///< a wheel that turns moves the robot by up to this share less, uniform

  bool any() const { return bias != 0 || noise != 0 || slip != 0; }
};

/// A position from outside, by GPS or a camera, that replaces what odometry says; the heading
/// stays.
struct PositionFixes {
  int64_t period_ms = 0;  ///< 0: none
  double sigma_m = 0;     ///< of each coordinate, normal
};

struct RobotGroup {
  std::string name;
  std::vector<sim::PlanePose> starts;  ///< one a robot; at least one
  double radius_m = 0.1;               ///< 0: a point that collides with nothing but walls
  Wheels wheels;
  OdometryErrors odometry;
  PositionFixes fixes;
  /// How far it drives on one battery, which each nest charges; then it stands. 0: no end.
  double range_m = 0;
  std::vector<uint8_t> senses;  ///< types, at most kPheromoneSlots; blends too
  uint8_t deposits = 0;         ///< the type deposited if the behaviour names no other; 0: none
  /// Null: whoever owns the world writes the actions, between World::Sense and World::Act.
  std::shared_ptr<Behaviour> behaviour;
};

/// Of a robot in messages; `robot` is its index in the world.
std::string NameOf(const RobotGroup& group, size_t robot);

}  // namespace pheromone::lab
