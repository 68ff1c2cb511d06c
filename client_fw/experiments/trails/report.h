// The results of the two-trail bench as text and CSV. Pure; any thread.
#pragma once

#include <string>

#include "client_fw/experiments/trails/run.h"
#include "client_fw/experiments/trails/story.h"

namespace pheromone::swarm {

/// What a run comes to, and what must not happen, if it did.
std::string ToTable(const TrailsRun& run);
/// Nothing touched, nothing was lost, nothing was refused: what must not happen did not.
bool IsSound(const TrailsRun& run);
/// The same for a run against a daemon, whose account is elsewhere.
bool IsSoundByRobots(const TrailsRun& run);

/// A header line, then a line for each deposit; each choice; each sample. Robots count from 1.
std::string DepositsToCsv(const TrailsRun& run);
std::string SamplesToCsv(const std::vector<TrailsSample>& samples);
std::string MarksToCsv(const std::vector<StoryMark>& marks);

/// Points of the areas that one robot at a time may enter, and of the lines; entrances, exits and
/// other tags; robots, whose `value` is their radius.
std::string BenchToCsv(const TrailsBench& bench, const std::vector<sim::PlanePose>& robots);

}  // namespace pheromone::swarm
