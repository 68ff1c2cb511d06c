// What a search tells of a way through a CleaningWorld: its steps, in words, and the soil on it.
//
//   for (const CleaningMoment& moment : trace) ... StepText(moment.step)   // "A claims zone 3"
#pragma once

#include <string>
#include <vector>

#include "client_fw/verify/cleaning_world.h"

namespace pheromone::verify {

/// One step of a trace, and the state after it. The first has no step.
struct CleaningMoment {
  CleaningStep step;
  CleaningState state;
  int time = 0;  ///< of the step, since the start
};

/// Robots are A, B, C ..., zones are counted from 1.
std::string StepText(const CleaningStep& step);

/// The soil in % of each zone after each moment, up to 100 %: also where the search knew only that
/// it was enough to be wrong, or that of one zone.
std::vector<std::vector<int>> SoilOn(const std::vector<CleaningMoment>& trace,
                                     const std::vector<int>& rates_percent, int start_percent);

}  // namespace pheromone::verify
