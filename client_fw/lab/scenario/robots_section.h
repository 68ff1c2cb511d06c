// The [[robots]] of a scenario; for scenario.cc.
#pragma once

#include "client_fw/lab/scenario/scenario.h"
#include "server/config/sections.h"

namespace pheromone::lab {

/// After the map, its pheromones and obstacles, gates and the seed. Errors are added to `notes`.
void ReadGroups(const config::Value& root, config::Notes* notes, LabScenario* scenario);

}  // namespace pheromone::lab
