// Pictures of a cleaning swarm, as SVG. Pure; any thread.
#pragma once

#include <string>

#include "client_fw/experiments/cleaning/experiment.h"

namespace pheromone::swarm {

/// The soil of each zone over time: a curve for each zone with the threshold and who cleaned when,
/// or, where there are more than kMaxSoilCurves zones, a heat map.
constexpr int kMaxSoilCurves = 24;
std::string DrawSoil(const CleaningExperiment& experiment, const CleaningRun& run);

/// The zones from above: how often each was cleaned, its longest gap, and the robots' tracks if
/// there are at most kMaxTracks robots and the run has tracks.
constexpr size_t kMaxTracks = 4;
std::string DrawFloor(const CleaningExperiment& experiment, const CleaningRun& run);

}  // namespace pheromone::swarm
