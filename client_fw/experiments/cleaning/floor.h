// A floor of one's own, as a TOML file says it: zones, soil, robots and what is asked of them. The
// same file is proved (client_fw/verify), simulated and cleaned in a running server's tags.
//
//   Result<CleaningFloor> floor = LoadFloor("hall.toml");
//   verify::ProveCleaning(floor.value().limits, floor.value().starts);
//   RunCleaning(ExperimentOf(floor.value(), CleaningExperiment()), seed);
//
// README.md has the keys. Times of the proof are units, of which one is `unit_ms`; zones and
// robots are counted from 1 in the file and from 0 here. Errors: `FILE:LINE:COL: KEY: what was
// found, what was expected`, all of a file at once. Pure but for reading the file; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "client_fw/experiments/cleaning/experiment.h"
#include "client_fw/experiments/cleaning/grid.h"
#include "client_fw/verify/cleaning_check.h"
#include "client_fw/verify/cleaning_world.h"
#include "server/base/result.h"

namespace pheromone::swarm {

struct CleaningFloor {
  std::string name;        ///< of the file, without folder and ".toml"
  CleaningGrid grid;       ///< with own zones; without a place if `beside` says who sees whom
  bool has_places = true;  ///< else it can only be proved
  verify::CleaningLimits limits;
  verify::CleaningStarts starts;       ///< empty: all
  verify::SoilPercents dirty{80, 30};  ///< from where, and below what, the first query
  verify::SoilPercents kept{20, 51};   ///< the second
  int horizon = 240;                   ///< of the second
  int64_t unit_ms = 3000;              ///< for the simulation
  std::string policy = "firmware";
};

Result<CleaningFloor> ParseFloor(std::string_view text, std::string_view name);
Result<CleaningFloor> LoadFloor(const std::string& path);

/// `base`, with the floor's zones, robots and times. Errors: a floor without places, or a policy
/// that the firmware does not have.
Result<CleaningExperiment> ExperimentOf(const CleaningFloor& floor, const CleaningExperiment& base);

}  // namespace pheromone::swarm
