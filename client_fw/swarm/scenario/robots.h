// The [[robots]] of a scenario; scenario.h has their keys.
//
//   ReadRobots(root, &notes, &scenario);        // after [map], [radio], pheromones and obstacles
//
// For scenario.cc. Pure except for checking whether an image exists.
#pragma once

#include "client_fw/swarm/scenario/scenario.h"
#include "server/config/sections.h"

namespace pheromone::swarm {

/// Errors are added to `notes`.
void ReadRobots(const config::Value& root, config::Notes* notes, Scenario* scenario);

}  // namespace pheromone::swarm
