#include "client_fw/experiments/trails/trips.h"

#include <fmt/format.h>

#include "client_fw/experiments/trails/report.h"
#include "client_fw/experiments/trails/timetable.h"

namespace pheromone::swarm {
namespace {

constexpr int kMaxTimedRobots = 7;

// The mean of the runs that locked in on each trail.
class LockedTrips {
 public:
  void Add(const TrailsSummary& summary) {
    if (summary.locked_on_a || summary.locked_on_b) {
      const size_t trail = summary.locked_on_b ? 1 : 0;
      sums_[trail] += summary.trips_per_hour;
      ++counts_[trail];
    }
  }
  std::array<double, kTrails> Means() const {
    std::array<double, kTrails> means{};
    for (size_t i = 0; i < kTrails; ++i) {
      means[i] = counts_[i] > 0 ? sums_[i] / counts_[i] : 0;
    }
    return means;
  }

 private:
  std::array<double, kTrails> sums_{};
  std::array<int, kTrails> counts_{};
};

}  // namespace

Result<std::vector<TripsPoint>> CountTrips(const TrailsBench& bench, TrailsExperiment experiment,
                                           int seeds,
                                           const std::function<void(const TripsPoint&)>& on_point) {
  std::vector<TripsPoint> points;
  for (int robots = 1; robots <= kMaxTimedRobots; ++robots) {
    experiment.rules.robots = robots;
    Timetable timetable = TimetableOf(bench, experiment.speed_mm_s / 1000.0);
    timetable.rules = experiment.rules;
    timetable.robot = experiment.robot;
    timetable.duration_ms = experiment.duration_ms;
    LockedTrips driven;
    LockedTrips by_timetable;
    for (int i = 1; i <= seeds; ++i) {
      const auto seed = static_cast<uint64_t>(i);
      const Result<TrailsRun> real = RunTrails(bench, experiment, seed);
      const Result<TrailsRun> model = RunTimetable(bench, timetable, seed);
      if (!real.ok() || !model.ok()) {
        return Error{real.ok() ? model.error() : real.error()};
      }
      for (const TrailsRun* const run : {&real.value(), &model.value()}) {
        if (!IsSound(*run)) {
          return Error{fmt::format("{} robots, seed {}:\n{}", robots, seed, ToTable(*run))};
        }
      }
      driven.Add(Summarise(real.value()));
      by_timetable.Add(Summarise(model.value()));
    }
    points.push_back({robots, driven.Means(), by_timetable.Means()});
    if (on_point) {
      on_point(points.back());
    }
  }
  return points;
}

std::string TripsToCsv(const std::vector<TripsPoint>& points) {
  std::string csv =
      "robots,driven_a_per_hour,driven_b_per_hour,timetable_a_per_hour,timetable_b_per_hour\n";
  const auto text = [](double trips) {
    return trips > 0 ? fmt::format("{:.1f}", trips) : std::string();
  };
  for (const TripsPoint& point : points) {
    csv += fmt::format("{},{},{},{},{}\n", point.robots, text(point.driven[0]),
                       text(point.driven[1]), text(point.timetable[0]), text(point.timetable[1]));
  }
  return csv;
}

}  // namespace pheromone::swarm
