// The levels of the lab beside each other: one scenario with as many robots and as much loss, at
// level "radio", where each byte is on the air, and at the two whose radio is modelled.
//
//   const Result<LevelFigures> air = MeasureLevel(file, lab::Level::kRadio, cell);
//   const Result<LevelFigures> law = MeasureLevel(file, lab::Level::kField, cell);
//   const Agreement agreement = Compare(law.value(), air.value());
//
// Pure except for reading the file; any thread.
#pragma once

#include <cstdint>
#include <string>

#include "client_fw/lab/scenario/scenario.h"
#include "server/base/result.h"

namespace pheromone::swarm {

struct LevelCell {
  int robots = 8;  ///< the first of the scenario's starts
  int lost_percent = 0;
  int seeds = 1;  ///< runs, with the seeds 1, 2 ...
};

/// Of all runs together.
struct LevelFigures {
  double answers_per_s = 0;  ///< mean of the runs
  double path_error_mm = 0;  ///< likewise
  double stops = 0;          ///< fail-safe stops, their sum
};

/// Runs the first group of a scenario, which has starts. Errors: those of the scenario, of the run,
/// and fewer starts than robots.
Result<LevelFigures> MeasureLevel(const std::string& file, lab::Level level, const LevelCell& cell);

/// What levels have to have in common.
struct Agreement {
  bool answers = false;     ///< within 3 %
  bool path_error = false;  ///< within 10 %
  /// Within a factor of 1.3; or, where stops are few, no farther apart than twice the standard
  /// deviation of the difference of two such counts.
  bool stops = false;

  bool holds() const { return answers && path_error && stops; }
};
Agreement Compare(const LevelFigures& figures, const LevelFigures& air);

}  // namespace pheromone::swarm
