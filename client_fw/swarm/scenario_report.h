// What came of a scenario, for people and for other programs.
#pragma once

#include <string>

#include "client_fw/swarm/recorder.h"
#include "client_fw/swarm/scenario.h"

namespace pheromone::swarm {

/// A line for each robot, one for each channel, and the state hash if there is one. Of a robot that
/// runs an image, what its modem could tell.
std::string Summarise(const Scenario& scenario, const SwarmRecord& record);

/// A header line, then a line a robot, from 1. What an image does not tell is left empty.
std::string RobotsToCsv(const Scenario& scenario, const SwarmRecord& record);

/// A header line, then a line a robot and sample; robots are counted from 1.
std::string TracksToCsv(const SwarmRecord& record);

/// A header line, then a line an answer.
std::string ExchangesToCsv(const SwarmRecord& record);

/// An SVG of the map around the ways, with obstacles and the pheromone as it was laid at the start.
std::string DrawScenario(const Scenario& scenario, const SwarmRecord& record);

}  // namespace pheromone::swarm
