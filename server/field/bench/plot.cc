#include "server/field/bench/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>

#include "server/field/bench/cases.h"
#include "server/field/bench/tables.h"

namespace pheromone::field::bench {
namespace {

constexpr double kWidth = 720;
constexpr double kLeft = 78;
constexpr double kRight = 24;
constexpr double kTop = 64;
constexpr double kPlotHeight = 380;
constexpr double kBottom = kTop + kPlotHeight;
constexpr double kLegendLine = 24;

// Okabe and Ito's colours, which people with any colour vision can tell apart; and a mark for each.
struct Look {
  const char* colour;
  const char* mark;  // a path around (0, 0)
};
constexpr Look kLooks[] = {
    {"#d55e00", "M-5 0A5 5 0 1 0 5 0A5 5 0 1 0 -5 0Z"},
    {"#0072b2", "M-4.5 -4.5H4.5V4.5H-4.5Z"},
    {"#009e73", "M0 -6L6 0L0 6L-6 0Z"},
    {"#56b4e9", "M0 -6L5.5 4.5H-5.5Z"},
    {"#cc79a7", "M0 6L5.5 -4.5H-5.5Z"},
    {"#333333", "M-5 -2H5V2H-5Z"},
};

// A logarithmic axis between two places on the paper.
class LogAxis {
 public:
  LogAxis(double low, double high, double from_px, double to_px)
      : low_(std::log(low)), high_(std::log(high)), from_px_(from_px), to_px_(to_px) {}
  double operator()(double value) const {
    const double share = high_ > low_ ? (std::log(value) - low_) / (high_ - low_) : 0.5;
    return std::lerp(from_px_, to_px_, share);
  }

 private:
  double low_;
  double high_;
  double from_px_;
  double to_px_;
};

class Drawing {
 public:
  explicit Drawing(const Chart& chart) : chart_(chart) {
    double low = INFINITY;
    double high = 0;
    for (const Series& series : chart_.series) {
      for (const Point& point : series.points) {
        xs_.insert(point.x);
        low = std::min(low, point.ns.p10);
        high = std::max(high, point.ns.p90);
      }
    }
    low_decade_ = static_cast<int>(std::floor(std::log10(low)));
    high_decade_ = static_cast<int>(std::ceil(std::log10(high)));
  }

  std::string Draw() {
    const LogAxis x(*xs_.begin(), *xs_.rbegin(), kLeft + 24, kWidth - kRight - 24);
    const LogAxis y(std::pow(10, low_decade_), std::pow(10, high_decade_), kBottom, kTop);
    const double height =
        kBottom + 62 + kLegendLine * std::ceil(static_cast<double>(chart_.series.size()) / 2);
    Add(R"svg(<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}">)svg",
        kWidth, height);
    Add("<style>text{{font-family:sans-serif;font-size:13px;fill:#333}}.t{{font-size:12px;"
        "fill:#666}}</style><rect width=\"100%\" height=\"100%\" fill=\"white\"/>");
    Add(R"svg(<text x="14" y="26" style="font-size:16px;font-weight:bold">{}</text>)svg",
        chart_.title);
    DrawGrid(x, y);
    for (size_t i = 0; i < chart_.series.size(); ++i) {
      if (!chart_.series[i].points.empty()) {
        DrawSeries(x, y, chart_.series[i], kLooks[i % std::size(kLooks)]);
      }
    }
    DrawLegend();
    Add("</svg>");
    return std::move(svg_);
  }

 private:
  template <typename... Args>
  void Add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(svg_), format, std::forward<Args>(args)...);
    svg_ += '\n';
  }

  void DrawGrid(const LogAxis& x, const LogAxis& y) {
    Add(R"svg(<text x="14" y="{:.0f}" class="t">time of one robot-step</text>)svg", kTop - 14);
    for (int decade = low_decade_; decade <= high_decade_; ++decade) {
      const double ns = std::pow(10, decade);
      Add(R"svg(<path d="M{0:.1f} {1:.1f}H{2:.1f}" stroke="#dddddd"/><text x="{3:.1f}" y="{4:.1f}" class="t" text-anchor="end">{5}</text>)svg",
          kLeft, y(ns), kWidth - kRight, kLeft - 8, y(ns) + 4, Decade(ns));
    }
    for (const double value : xs_) {
      Add(R"svg(<path d="M{0:.1f} {1:.1f}V{2:.1f}" stroke="#eeeeee"/><text x="{0:.1f}" y="{3:.1f}" class="t" text-anchor="middle">{4}</text>)svg",
          x(value), kTop, kBottom, kBottom + 18, value);
    }
    Add(R"svg(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)svg",
        (kLeft + kWidth - kRight) / 2, kBottom + 40, chart_.x_label);
  }

  void DrawSeries(const LogAxis& x, const LogAxis& y, const Series& series, const Look& look) {
    std::string line;
    for (const Point& point : series.points) {
      fmt::format_to(std::back_inserter(line), "{:.1f},{:.1f} ", x(point.x), y(point.ns.median));
    }
    Add(R"svg(<polyline points="{}" fill="none" stroke="{}" stroke-width="2"/>)svg", line,
        look.colour);
    for (const Point& point : series.points) {
      Add(R"svg(<path d="M{0:.1f} {1:.1f}V{2:.1f}" stroke="{3}"/><path transform="translate({0:.1f} {4:.1f})" d="{5}" fill="{3}"/>)svg",
          x(point.x), y(point.ns.p10), y(point.ns.p90), look.colour, y(point.ns.median), look.mark);
    }
  }

  void DrawLegend() {
    size_t place = 0;
    for (size_t i = 0; i < chart_.series.size(); ++i) {
      if (chart_.series[i].points.empty()) {
        continue;
      }
      const Look& look = kLooks[i % std::size(kLooks)];
      const double left = place % 2 == 0 ? kLeft : kLeft + 322;
      const double middle = kBottom + 64 + kLegendLine * std::floor(static_cast<double>(place) / 2);
      ++place;
      Add(R"svg(<path d="M{0:.1f} {1:.1f}h32" stroke="{2}" stroke-width="2"/><path transform="translate({3:.1f} {1:.1f})" d="{4}" fill="{2}"/><text x="{5:.1f}" y="{6:.1f}">{7}</text>)svg",
          left, middle, look.colour, left + 16, look.mark, left + 42, middle + 4,
          chart_.series[i].label);
    }
  }

  static std::string Decade(double ns) {
    static constexpr const char* kUnits[] = {"ns", "µs", "ms", "s"};
    size_t unit = 0;
    while (ns >= 999.5 && unit + 1 < std::size(kUnits)) {
      ns /= 1000;
      ++unit;
    }
    return fmt::format("{:g} {}", ns, kUnits[unit]);
  }

  Chart chart_;
  std::set<double> xs_;
  int low_decade_ = 0;
  int high_decade_ = 0;
  std::string svg_;
};

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

}  // namespace

std::string DrawChart(const Chart& chart) {
  return Drawing(chart).Draw();
}

std::vector<Picture> Pictures(const Results& results) {
  constexpr int kRobots = 100;
  const auto in_case = [](const CaseKey& key, int32_t nodes, bool own, int reach, int robots) {
    return (nodes == 0 || key.map.nodes == nodes) && own == (key.map.density_percent == 0) &&
           (reach == 0 || key.reach == reach) && (robots == 0 || key.robots == robots);
  };
  struct Plan {
    const char* file;
    Chart chart;
    std::function<bool(const CaseKey&)> wanted;
    std::function<double(const CaseKey&)> x;
  };
  const std::vector<Plan> plans = {
      {"step_over_map_size.svg",
       {"Robot-step against the size of the map", "nodes along a side (100 robots, r = 10)", {}},
       [&](const CaseKey& key) { return in_case(key, 0, true, kStandardReach, kRobots); },
       [](const CaseKey& key) { return key.map.nodes; }},
      {"step_over_density.svg",
       {"Robot-step against density",
        "nodes with pheromone, % (1000 x 1000 nodes, 100 robots, r = 10)",
        {}},
       [&](const CaseKey& key) { return in_case(key, 1000, false, kStandardReach, kRobots); },
       [](const CaseKey& key) { return key.map.density_percent; }},
      {"step_over_reach.svg",
       {"Robot-step against reach", "r = c + σ, cells (1000 x 1000 nodes, 100 robots)", {}},
       [&](const CaseKey& key) { return in_case(key, 1000, true, 0, kRobots); },
       [](const CaseKey& key) { return key.reach; }},
      {"step_over_robots.svg",
       {"Robot-step against the number of robots",
        "robots, each taking one step a frame (1000 x 1000 nodes, r = 10)",
        {}},
       [&](const CaseKey& key) { return in_case(key, 1000, true, kStandardReach, 0); },
       [](const CaseKey& key) { return key.robots; }},
  };
  std::vector<Picture> pictures;
  for (const auto& [file, plan, wanted, x] : plans) {
    Chart chart = plan;
    bool any = false;
    for (const auto& [variant, label] : kLines) {
      Series series{label, {}};
      for (const auto& [key, ns, repetitions] : results.All()) {
        if (key.group == kRobotStep && key.variant == variant && wanted(key)) {
          series.points.push_back({x(key), ns});
          any = true;
        }
      }
      std::sort(series.points.begin(), series.points.end(),
                [](const Point& a, const Point& b) { return a.x < b.x; });
      chart.series.push_back(std::move(series));
    }
    if (any) {
      pictures.push_back({file, DrawChart(chart)});
    }
  }
  return pictures;
}

}  // namespace pheromone::field::bench
