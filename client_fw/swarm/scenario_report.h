// What came of a scenario, for people and for other programs.
#pragma once

#include <string>

#include "client_fw/swarm/scenario_run.h"

namespace pheromone::swarm {

/// A line for each robot, one for each channel, and the state hash.
std::string Summarise(const Scenario& scenario, const ScenarioResult& result);

/// A header line, then a line a robot and sample; robots are counted from 1.
std::string TracksToCsv(const ScenarioResult& result);

/// A header line, then a line an answer.
std::string ExchangesToCsv(const ScenarioResult& result);

/// An SVG of the map around the ways, with the pheromone as it was laid at the start. Obstacles are
/// not drawn.
std::string DrawScenario(const Scenario& scenario, const ScenarioResult& result);

}  // namespace pheromone::swarm
