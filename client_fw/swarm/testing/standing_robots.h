// Robots of a simulation that stand and ask, for tests of the channel.
#pragma once

#include <cstddef>
#include <cstdint>

#include "client_fw/swarm/simulation.h"

namespace pheromone::swarm {

/// The robot of this index, counted from 0: asks five times a second, type 2.
inline RobotConfig StandingRobot(int index) {
  RobotConfig robot;
  robot.client.id = static_cast<uint8_t>(3 + index);
  robot.client.boot_counter = static_cast<uint16_t>(7 + index);
  robot.client.type = 2;
  robot.client.speed_mm_s = 0;
  robot.client.period_ms = 200;
  robot.start = {2, 2.5, 0.4};
  return robot;
}

/// Of all robots, since they were switched on.
inline uint32_t FailSafeStops(const Simulation& simulation) {
  uint32_t stops = 0;
  for (size_t i = 0; i < simulation.robot_count(); ++i) {
    stops += simulation.robot(i).counters().fail_safe_stops;
  }
  return stops;
}

}  // namespace pheromone::swarm
