// How many round trips an hour robots make that have locked in on a trail, against their number:
// driven, and by a timetable of the same ways.
//
//   Result<std::vector<TripsPoint>> points = CountTrips(bench, experiment, /*seeds=*/4);
//   TripsToCsv(points.value());
//
// Pure; any thread.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "client_fw/experiments/trails/experiment.h"

namespace pheromone::swarm {

struct TripsPoint {
  int robots = 0;
  std::array<double, kTrails> driven{};     ///< an hour, by trail; 0: no such run
  std::array<double, kTrails> timetable{};  ///< likewise
};

/// One to seven robots, else as in `experiment`: means over the runs of seed 1 to `seeds` that
/// locked in. `on_point`, if given, is called with each. Errors: those of RunTrails and
/// RunTimetable; a run in which robots touched, a record was refused or a deposit was lost.
Result<std::vector<TripsPoint>> CountTrips(const TrailsBench& bench, TrailsExperiment experiment,
                                           int seeds,
                                           const std::function<void(const TripsPoint&)>& on_point);

/// A header line, then a line for each number of robots.
std::string TripsToCsv(const std::vector<TripsPoint>& points);

}  // namespace pheromone::swarm
