// Moments of runs of the double bridge, as CSV: corridors, trail and robots.
//
// Runs the simulations again whose moments are wanted; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/experiments/bridge/experiment.h"

namespace pheromone::swarm {

/// One moment of one run.
struct BridgeMoment {
  BridgeExperiment experiment;
  uint64_t seed = 1;
  int64_t time_ms = 0;
  Outcome outcome = Outcome::kUndecided;  ///< of the run
};

/// A header line, then a line for each point of a corridor, node with pheromone, robot, nest and
/// food. `value` is a node's share of its maximum, or a robot's heading in degrees.
std::string MomentsToCsv(const std::vector<BridgeMoment>& moments);

}  // namespace pheromone::swarm
