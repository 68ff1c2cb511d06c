// The results of a cleaning swarm as text: a table of zones, and CSV files. Pure; any thread.
#pragma once

#include <string>

#include "client_fw/experiments/cleaning/experiment.h"

namespace pheromone::swarm {

/// A line for each zone: its rate, how often it was cleaned, the longest gap, the highest soil, or
/// that it is closed; then the swarm's figures, and what must not happen, if it did.
std::string ToTable(const CleaningExperiment& experiment, const CleaningRun& run);

/// A header line, then a line for each open zone; for each cleaning; for each change of an open
/// zone's soil. Zones and robots are counted from 1.
std::string ZonesToCsv(const CleaningExperiment& experiment, const CleaningRun& run);
std::string CleaningsToCsv(const CleaningRun& run);
std::string SoilToCsv(const CleaningExperiment& experiment, const CleaningRun& run);

/// A line for each robot and sample, if the run has tracks.
std::string TracksToCsv(const CleaningExperiment& experiment, const CleaningRun& run);

}  // namespace pheromone::swarm
