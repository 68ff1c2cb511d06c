// Behaviours that walk about: explore, patrol, aggregate. Each is a function of what the robot
// senses and of its memory.
#pragma once

#include <cstdint>
#include <memory>

#include "client_fw/lab/behaviour.h"

namespace pheromone::lab {

struct ExploreSettings {
  double speed_m_s = 0.2;
  double wander_rad = 0.35;  ///< deviation of the course after a second
  uint16_t quanta = 0;       ///< deposited in each step
};
/// A correlated random walk that turns back at whatever it meets.
std::shared_ptr<Behaviour> MakeExplore(const ExploreSettings& settings);

struct PatrolSettings {
  ExploreSettings walk{.quanta = 1};
  double gain = 1;  ///< of the law, as the firmware's gain; 1/8 to 3.5
};
/// Marks where it was and goes where the marks are weaker: the differential law of the core
/// (steering.h) with the antennas exchanged. Without marks it explores.
std::shared_ptr<Behaviour> MakePatrol(const PatrolSettings& settings);

struct AggregateSettings {
  ExploreSettings walk;  ///< its quanta are deposited while it waits
  double wait_s = 60;    ///< the longest
  double half = 0.5;     ///< pheromone units at which it waits half as long
};
/// Robots that meet wait the longer, the more they sense: wait p^2 / (p^2 + half^2), the BEECLUST
/// of Schmickl et al., "Get in touch: cooperative decision making based on robot-to-robot
/// collisions", 2009.
std::shared_ptr<Behaviour> MakeAggregate(const AggregateSettings& settings);

}  // namespace pheromone::lab
