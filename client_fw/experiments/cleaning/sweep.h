// How long zones wait on larger floors: the worst gap against the grid's size, with about six zones
// for each robot, the firmware over the radio beside the decision alone (model.h).
//
//   const std::vector<CleaningSeries> all = {RunSeries(CleaningSizes(base)[0], cycles, seeds)};
//
// Virtual time. A series runs on all processors; its result does not depend on their number.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client_fw/experiments/cleaning/experiment.h"

namespace pheromone::swarm {

/// Runs of one experiment, of seed 1, 2, ...
struct CleaningSeries {
  CleaningExperiment experiment;
  std::vector<CleaningRun> runs;
  std::vector<double> model_gaps;  ///< ModelWorstGap of the same seeds and number of cycles
};

/// 4 x 3 zones with 2 robots, 6 x 6 with 6, 10 x 10 with 16, 15 x 15 with 37, 20 x 20 with 66. All
/// else as in `base`, but for as many channels as robots need: one for each kRobotsOfChannel begun.
constexpr int kRobotsOfChannel = 9;
std::vector<CleaningExperiment> CleaningSizes(const CleaningExperiment& base);

/// Each run lasts for `cycles` ideal cycles. `on_second`, if given, is called after each second of
/// each run with the number of runs done, by one thread at a time.
CleaningSeries RunSeries(const CleaningExperiment& experiment, int cycles, int seeds,
                         const std::function<void(int done, int64_t second)>& on_second = {});

/// A line for each series.
std::string ToTableHead();
std::string ToTableRow(const CleaningSeries& series);

/// A header line, then a line for each run.
std::string ToCsv(const std::vector<CleaningSeries>& all);

}  // namespace pheromone::swarm
