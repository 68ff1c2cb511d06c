#include "client_fw/experiments/sweep/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include "server/chart/panels.h"

namespace pheromone::swarm {
namespace {

constexpr int kColumns = 4;

Sweep Of(std::string name, std::string label, std::vector<double> values,
         std::function<void(FollowConditions*, double)> set) {
  return {std::move(name), std::move(label), std::move(values),
          [set = std::move(set)](FollowConditions conditions, double value) {
            set(&conditions, value);
            return conditions;
          }};
}

std::vector<Sweep> MakeSweeps() {
  using Conditions = FollowConditions;
  return {
      Of("cell", "cell size a, m", {0.05, 0.1, 0.15, 0.2, 0.25, 0.3},
         [](Conditions* c, double value) { c->cell_m = value; }),
      Of("core", "core c, m", {0, 0.05, 0.1, 0.15, 0.2, 0.3},
         [](Conditions* c, double value) { c->core_m = value; }),
      Of("sigma", "slope sigma, m", {0.1, 0.2, 0.3, 0.4, 0.6, 0.8},
         [](Conditions* c, double value) { c->sigma_m = value; }),
      Of("speed", "speed K, mm/s", {100, 200, 300, 400, 500, 600, 800},
         [](Conditions* c, double value) {
           c->steering.speed_mm_s = static_cast<int16_t>(std::lround(value));
         }),
      Of("period", "period, ms", {100, 200, 300, 400, 600, 800, 1000},
         [](Conditions* c, double value) {
           c->period_ms = static_cast<uint16_t>(std::lround(value));
         }),
      Of("latency", "server's delay, ms", {2, 10, 20, 50, 100, 150},
         [](Conditions* c, double value) { c->latency_ms = value; }),
      Of("loss", "frames lost, %", {0, 5, 10, 20, 30, 40},
         [](Conditions* c, double value) { c->frame_loss = value / 100; }),
      Of("drift", "odometry: right wheel, %", {0, 0.1, 0.2, 0.5, 1, 2},
         [](Conditions* c, double value) { c->odometry_drift = value / 100; }),
  };
}

std::string LabelOf(const std::string& name) {
  const std::vector<Sweep>& sweeps = Sweeps();
  const auto found = std::find_if(sweeps.begin(), sweeps.end(),
                                  [&](const Sweep& sweep) { return sweep.name == name; });
  return found == sweeps.end() ? name : found->label;
}

// Beyond it a robot has lost the path, and the value is meaningless.
constexpr double kLargestErrorMm = 200;

// One diagram of `figure` over the points of one sweep, with one line per contender.
chart::Panel PanelOf(const std::vector<SweepPoint>& points, const std::string& sweep,
                     const std::string& y_label, Spread FollowSummary::*figure) {
  chart::Panel panel;
  panel.title = sweep;
  panel.x_label = LabelOf(sweep);
  panel.y_label = y_label;
  for (const SweepPoint& point : points) {
    if (point.sweep != sweep) {
      continue;
    }
    auto series = std::find_if(
        panel.series.begin(), panel.series.end(),
        [&](const chart::Series& candidate) { return candidate.label == point.contender.name; });
    if (series == panel.series.end()) {
      panel.series.push_back({point.contender.name, point.contender.colour, {}});
      series = std::prev(panel.series.end());
    }
    const Spread& spread = point.summary.*figure;
    series->marks.push_back({point.value, spread.mean, spread.least, spread.most});
  }
  return panel;
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

std::string DrawSweeps(const std::vector<SweepPoint>& points, Curve curve) {
  std::vector<std::string> names;
  for (const SweepPoint& point : points) {
    if (std::find(names.begin(), names.end(), point.sweep) == names.end()) {
      names.push_back(point.sweep);
    }
  }
  std::vector<chart::Panel> panels;
  for (size_t begin = 0; begin < names.size(); begin += kColumns) {
    const size_t end = std::min(names.size(), begin + kColumns);
    for (size_t i = begin; i < end; ++i) {
      panels.push_back(PanelOf(points, names[i], "mean error, mm", &FollowSummary::error_mm));
      panels.back().y_most = kLargestErrorMm;
    }
    for (size_t i = begin; i < end; ++i) {
      panels.push_back(PanelOf(points, names[i], "progress, mm/s", &FollowSummary::progress_mm_s));
    }
  }
  return chart::DrawPanels(
      fmt::format("Following the {}: one parameter at a time; whiskers over seeds", NameOf(curve)),
      panels, {.columns = std::min(kColumns, static_cast<int>(names.size()))});
}

}  // namespace pheromone::swarm
