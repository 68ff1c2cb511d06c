// A run of a scenario: its events at their times, and what is measured.
//
//   const Result<LabResult> run = RunLab(scenario, /*threads=*/2, {});
//   for (const auto& [name, value] : MeasuresOf(run.value())) ...
//
// Measures, of the whole run:
//   deliveries_per_robot_hour    loads brought to a nest
//   trip_s, path_efficiency      of them: the mean time since they were picked up, and the sum of
//                                shortest ways (field::FindRoute, from rim to rim) over that of
//                                ways
//   ..._contacts_per_robot_hour  begun, with other robots and with walls
//   standing_share               of robots and steps: moved by less than a millimetre
//   covered_share                of the places of [measure], those that a robot was at
//   answers_per_s                with intensities, of all robots together, from [measure] from_s on
//   fail_safe_stops              from then on: robots that had no answer for 480 ms
//   path_error_mm                from then on, where the map has paths: how far robots are from the
//                                one that they started at, in the mean, looked at once a second
//   idle_mean_s                  the time since a robot was at a place, over places and time
//   idle_most_s                  the longest such time at the end
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/lab/scenario/scenario.h"
#include "client_fw/lab/world.h"
#include "server/base/result.h"

namespace pheromone::lab {

struct LabResult {
  bool on_air = false;  ///< level "radio", which has no world to measure
  size_t robots = 0;
  int64_t step_ms = 200;
  uint64_t steps = 0;
  uint64_t hash = 0;
  int64_t measured_ms = 0;  ///< since [measure] from_s
  WorldTally tally;
  Trips trips;
  Coverage::Share coverage;
};

/// What was measured in a world until now.
LabResult ResultOf(const World& world);

/// The same result for any number of threads. `look` is called before the first step and after
/// each; it may be empty. `server` is MakeWorld's. Errors: those of World and of `look`.
Result<LabResult> RunLab(const LabScenario& scenario, int threads,
                         const std::function<Status(const World&)>& look,
                         std::shared_ptr<Server> server = nullptr);

/// By name; none: not measured, as at level "radio" all but time, answers, stops and paths.
using Measure = std::pair<std::string, std::optional<double>>;

/// Always the same names, in the order of the summary's columns.
std::vector<Measure> MeasuresOf(const LabResult& result);

}  // namespace pheromone::lab
