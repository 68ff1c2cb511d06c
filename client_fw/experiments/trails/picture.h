// Pictures of the two-trail bench, as SVG. Pure; any thread.
#pragma once

#include <string>
#include <vector>

#include "client_fw/experiments/trails/bench.h"
#include "client_fw/experiments/trails/run.h"
#include "client_fw/experiments/trails/story.h"

namespace pheromone::swarm {

/// Lines, tags, the two areas that one robot at a time may enter, and robots.
std::string DrawBench(const TrailsBench& bench, const std::vector<sim::PlanePose>& robots);

/// The concentrations of both trails over time and, below, the advice.
std::string DrawConcentrations(const std::string& title, const std::vector<TrailsSample>& samples,
                               const std::vector<StoryMark>& marks = {});

/// How many robots were on each trail.
std::string DrawShares(const std::string& title, const TrailsRun& run);

}  // namespace pheromone::swarm
