// The runs that a scenario's [sweep] asks for, a command line each:
//
//   [sweep]
//   seeds = 30                         # 1 to 30, or an array of them
//   "robots[1].count" = [50, 100]      # all combinations
//
// Each command is a run by itself: same command, same row. Pure.
#pragma once

#include <string>
#include <vector>

#include "client_fw/lab/scenario/tree.h"
#include "server/base/result.h"
#include "server/config/document.h"

namespace pheromone::lab {

struct SweepRun {
  KeyValues settings;
  uint64_t seed = 1;
};

/// All runs, the seeds within the values. Errors, in words as those of ReadLabScenario: no [sweep],
/// a value that is no array or empty, more than a million runs.
Result<std::vector<SweepRun>> RunsOf(const config::Value& tree, const std::string& name);

/// "pheromone-swarm lab run FILE --set 'KEY=VALUE' --seed N", for a shell; with "--summary FILE" if
/// `summary` is not empty.
std::string CommandOf(const SweepRun& run, const std::string& file, const std::string& summary);

}  // namespace pheromone::lab
