// The results of a scenario, for people and for other programs.
#pragma once

#include <string>

#include "client_fw/swarm/recorder.h"
#include "client_fw/swarm/scenario/scenario.h"

namespace pheromone::swarm {

/// A line for each robot, one for each channel, and the state hash if there is one. For a robot
/// that runs an image, as counted by its modem.
std::string Summarise(const Scenario& scenario, const SwarmRecord& record);

/// A header line, then one line per robot, from 1. Figures that an image does not report are empty.
std::string RobotsToCsv(const Scenario& scenario, const SwarmRecord& record);

/// A header line, then one line per robot and sample; robots are counted from 1.
std::string TracksToCsv(const SwarmRecord& record);

/// A header line, then one line per answer.
std::string ExchangesToCsv(const SwarmRecord& record);

/// An SVG of the map around the tracks, with obstacles and the initial pheromone.
std::string DrawScenario(const Scenario& scenario, const SwarmRecord& record);

}  // namespace pheromone::swarm
