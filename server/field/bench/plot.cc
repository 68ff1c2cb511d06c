#include "server/field/bench/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "server/chart/panels.h"
#include "server/field/bench/cases.h"

namespace pheromone::field::bench {
namespace {

struct Line {
  const char* variant;
  const char* label;
};
constexpr Line kLines[] = {
    {kField, "this field"},
    {kLiteralScan, "the paper's scan, literally"},
    {kWideScan, "one-pass SIMD scan of the map"},
    {kSkippingScan, "the same, skipping what is out of reach"},
    {kDenseSweep, "dense sweep a frame, stamped cones"},
};

// "100 ns", "1 µs": a power of ten.
std::string Tick(double ns) {
  static constexpr const char* kUnits[] = {"ns", "µs", "ms", "s"};
  size_t unit = 0;
  while (ns >= 999.5 && unit + 1 < std::size(kUnits)) {
    ns /= 1000;
    ++unit;
  }
  return fmt::format("{:g} {}", ns, kUnits[unit]);
}

}  // namespace

std::vector<Picture> Pictures(const Results& results) {
  constexpr int kRobots = 100;
  constexpr chart::Layout kLayout = {.columns = 1, .panel_width = 660, .panel_height = 430};
  const auto in_case = [](const CaseKey& key, int32_t nodes, bool own, int reach, int robots) {
    return (nodes == 0 || key.map.nodes == nodes) && own == (key.map.density_percent == 0) &&
           (reach == 0 || key.reach == reach) && (robots == 0 || key.robots == robots);
  };
  struct Plan {
    const char* file;
    const char* title;
    const char* x_label;
    std::function<bool(const CaseKey&)> wanted;
    std::function<double(const CaseKey&)> x;
  };
  const std::vector<Plan> plans = {
      {"step_over_map_size.svg", "Robot-step against the size of the map",
       "nodes along a side (100 robots, r = 10)",
       [&](const CaseKey& key) { return in_case(key, 0, true, kStandardReach, kRobots); },
       [](const CaseKey& key) { return key.map.nodes; }},
      {"step_over_density.svg", "Robot-step against density",
       "nodes with pheromone, % (1000 x 1000 nodes, 100 robots, r = 10)",
       [&](const CaseKey& key) { return in_case(key, 1000, false, kStandardReach, kRobots); },
       [](const CaseKey& key) { return key.map.density_percent; }},
      {"step_over_reach.svg", "Robot-step against reach",
       "r = c + σ, cells (1000 x 1000 nodes, 100 robots)",
       [&](const CaseKey& key) { return in_case(key, 1000, true, 0, kRobots); },
       [](const CaseKey& key) { return key.reach; }},
      {"step_over_robots.svg", "Robot-step against the number of robots",
       "robots, each taking one step a frame (1000 x 1000 nodes, r = 10)",
       [&](const CaseKey& key) { return in_case(key, 1000, true, kStandardReach, 0); },
       [](const CaseKey& key) { return key.robots; }},
  };
  std::vector<Picture> pictures;
  for (const auto& [file, title, x_label, wanted, x] : plans) {
    chart::Panel panel;
    panel.x_label = x_label;
    panel.y_label = "time of one robot-step";
    panel.x_scale = panel.y_scale = chart::Scale::kLogarithmic;
    panel.y_tick = Tick;
    bool any = false;
    for (const auto& [variant, label] : kLines) {
      chart::Series series{label, "", {}};
      for (const auto& [key, ns, repetitions] : results.All()) {
        if (key.group == kRobotStep && key.variant == variant && wanted(key)) {
          series.marks.push_back({x(key), ns.median, ns.p10, ns.p90});
          any = true;
        }
      }
      std::sort(series.marks.begin(), series.marks.end(),
                [](const chart::Mark& a, const chart::Mark& b) { return a.x < b.x; });
      panel.series.push_back(std::move(series));
    }
    if (any) {
      pictures.push_back({file, chart::DrawPanels(title, {panel}, kLayout)});
    }
  }
  return pictures;
}

}  // namespace pheromone::field::bench
