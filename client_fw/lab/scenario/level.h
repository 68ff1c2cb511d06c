// What a level knows of a scenario; for scenario.cc.
#pragma once

#include <string>

#include "client_fw/lab/scenario/scenario.h"
#include "server/config/sections.h"

namespace pheromone::lab {

/// `level = "radio"`, for messages.
std::string LevelText(const LabScenario& scenario);

/// Notes each key and table that would have no effect at the scenario's level, once all of it was
/// read without a problem: below "field", robots follow one pheromone and deposit the same, a
/// quantum at a time, and "radio" has only what the simulator of pheromone-swarm run has.
void CheckLevel(const config::Value& root, const LabScenario& scenario, config::Notes* notes);

}  // namespace pheromone::lab
