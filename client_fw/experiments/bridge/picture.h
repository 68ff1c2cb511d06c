// Pictures of the double bridge experiment, as SVG: choices over time, where swarms ended, and the
// arena with its trails.
//
// Pure except for DrawTrails, which runs the simulations whose moments it shows; any thread. The
// same data give the same bytes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/experiments/bridge/experiment.h"

namespace pheromone::swarm {

/// One panel per series: the share of the short branch in each minute, of each run and on average.
std::string DrawShares(const std::vector<BridgeSeries>& all);

/// One row per series: how many swarms chose which branch, and each run's final share.
std::string DrawOutcomes(const std::vector<BridgeSeries>& all);

/// How often robots took the short branch, against its share of the trail at the entries, over all
/// choices of a series; beside it Deneubourg's choice function.
std::string DrawChoices(const BridgeSeries& series);

/// One moment of one run.
struct BridgeMoment {
  BridgeExperiment experiment;
  uint64_t seed = 1;
  int64_t time_ms = 0;
  std::string caption;
};

/// One panel per moment: corridors, trail and robots.
std::string DrawTrails(const std::vector<BridgeMoment>& moments);

}  // namespace pheromone::swarm
