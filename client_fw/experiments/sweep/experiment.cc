#include "client_fw/experiments/sweep/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

namespace pheromone::swarm {
namespace {

Sweep Of(std::string name, std::vector<double> values,
         std::function<void(FollowConditions*, double)> set) {
  return {std::move(name), std::move(values),
          [set = std::move(set)](FollowConditions conditions, double value) {
            set(&conditions, value);
            return conditions;
          }};
}

std::vector<Sweep> MakeSweeps() {
  using Conditions = FollowConditions;
  return {
      Of("cell", {0.05, 0.1, 0.15, 0.2, 0.25, 0.3},
         [](Conditions* c, double value) { c->cell_m = value; }),
      Of("core", {0, 0.05, 0.1, 0.15, 0.2, 0.3},
         [](Conditions* c, double value) { c->core_m = value; }),
      Of("sigma", {0.1, 0.2, 0.3, 0.4, 0.6, 0.8},
         [](Conditions* c, double value) { c->sigma_m = value; }),
      Of("speed", {100, 200, 300, 400, 500, 600, 800},
         [](Conditions* c, double value) {
           c->steering.speed_mm_s = static_cast<int16_t>(std::lround(value));
         }),
      Of("period", {100, 200, 300, 400, 600, 800, 1000},
         [](Conditions* c, double value) {
           c->period_ms = static_cast<uint16_t>(std::lround(value));
         }),
      Of("latency", {2, 10, 20, 50, 100, 150},
         [](Conditions* c, double value) { c->latency_ms = value; }),
      Of("loss", {0, 5, 10, 20, 30, 40},
         [](Conditions* c, double value) { c->frame_loss = value / 100; }),
      Of("drift", {0, 0.1, 0.2, 0.5, 1, 2},
         [](Conditions* c, double value) { c->odometry_drift = value / 100; }),
  };
}

}  // namespace

const std::vector<Sweep>& Sweeps() {
  static const std::vector<Sweep> sweeps = MakeSweeps();
  return sweeps;
}

std::vector<SweepPoint> RunSweep(const Sweep& sweep, const std::vector<Contender>& contenders,
                                 Curve curve, int seeds, const std::function<void()>& shown) {
  std::vector<SweepPoint> points;
  for (const Contender& contender : contenders) {
    for (const double value : sweep.values) {
      shown();
      FollowConditions conditions;
      conditions.curve = curve;
      conditions.steering = contender.steering;
      points.push_back(
          {sweep.name, value, contender, FollowSeeds(sweep.at(conditions, value), 1, seeds)});
    }
  }
  return points;
}

std::string ToCsv(const std::vector<SweepPoint>& points) {
  std::string csv =
      "parameter,value,law,runs,mean_error_mm,error_deviation_mm,worst_error_mm,"
      "late_mean_error_mm,progress_mm_s,progress_deviation_mm_s,worst_progress_mm_s\n";
  for (const SweepPoint& point : points) {
    const FollowSummary& s = point.summary;
    csv += fmt::format("{},{:g},{},{},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f}\n",
                       point.sweep, point.value, point.contender.name, s.runs, s.error_mm.mean,
                       s.error_mm.deviation, s.error_mm.most, s.late_error_mm.mean,
                       s.progress_mm_s.mean, s.progress_mm_s.deviation, s.progress_mm_s.least);
  }
  return csv;
}

}  // namespace pheromone::swarm
