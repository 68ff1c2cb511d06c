#include "client_fw/experiments/trails/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "server/chart/axis.h"
#include "server/chart/svg.h"

namespace pheromone::swarm {
namespace {

constexpr const char* kColourA = "#0072b2";
constexpr const char* kColourB = "#d55e00";
constexpr const char* kColourNest = "#009e73";
constexpr double kScale = 76;  // pixels a metre

const char* ColourOf(int line) {
  switch (line) {
    case kTrailAOut:
    case kTrailABack:
      return kColourA;
    case kTrailBOut:
    case kTrailBBack:
      return kColourB;
    default:
      return kColourNest;
  }
}

const char* ColourOf(petri::Advice advice) {
  return advice == petri::Advice::kA ? kColourA : advice == petri::Advice::kB ? kColourB : "#bbb";
}

bool IsEntrance(std::string_view tag) {
  return tag == "N1" || tag == "N2" || tag == "N3" || tag == "S1" || tag == "S2";
}

// A curve as steps would be a wall of points: one for each pixel is enough.
template <typename Y>
std::string PathOf(const std::vector<TrailsSample>& samples, const Y& y_of, double left,
                   double width, double end_s) {
  std::string path;
  double last_x = -1;
  for (const TrailsSample& sample : samples) {
    const double x = left + width * static_cast<double>(sample.time_ms) / 1000 / end_s;
    if (x - last_x >= 0.5) {
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x, y_of(sample));
      last_x = x;
    }
  }
  return path;
}

}  // namespace

std::string DrawBench(const TrailsBench& bench, const std::vector<sim::PlanePose>& robots) {
  const field::MapGeometry& map = bench.config.engine.field.map;
  const double width_m = static_cast<double>(map.width_um) / 1e6;
  const double height_m = static_cast<double>(map.height_um) / 1e6;
  constexpr double kLeft = 20;
  constexpr double kTop = 64;
  const auto x_of = [&](double x_m) { return kLeft + kScale * x_m; };
  const auto y_of = [&](double y_m) { return kTop + kScale * (height_m - y_m); };
  chart::Svg svg(2 * kLeft + kScale * width_m, kTop + kScale * height_m + 34,
                 "The two-trail bench");
  svg.Text(12, 48, "t",
           "squares: entrances, where robots wait for green; circles: exits; shaded: one robot at "
           "a time; discs: robots");
  svg.Add(
      R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="none" stroke="#ccc"/>)svg",
      x_of(0), y_of(height_m), kScale * width_m, kScale * height_m);
  // Within an area: from its entrances to its tag, and to its exits.
  struct Part {
    int line;
    const char* from;
    const char* to;
  };
  constexpr std::array<Part, 10> kAreas = {{{kNestLine, "N1", "P"},
                                            {kTrailAOut, "P", "N5"},
                                            {kTrailBOut, "P", "N6"},
                                            {kTrailABack, "N2", "P"},
                                            {kTrailBBack, "N3", "P"},
                                            {kHomeLine, "P", "N4"},
                                            {kTrailAOut, "S1", "Src"},
                                            {kTrailBOut, "S2", "Src"},
                                            {kTrailABack, "Src", "S3"},
                                            {kTrailBBack, "Src", "S4"}}};
  const auto polyline = [&](int line, double from_m, double to_m) {
    std::string points;
    for (const sim::PlanePose& pose : bench.PlacesOn(line, from_m, to_m, 0.05)) {
      points += fmt::format("{:.1f},{:.1f} ", x_of(pose.x_m), y_of(pose.y_m));
    }
    return points;
  };
  for (const Part& part : kAreas) {
    svg.Add(
        R"svg(<polyline points="{}" fill="none" stroke="#f3ead0" stroke-width="{:.1f}" stroke-linecap="round"/>)svg",
        polyline(part.line, bench.AlongOf(part.line, *bench.FindTag(part.from)),
                 bench.AlongOf(part.line, *bench.FindTag(part.to))),
        2.4 * kBenchRobotRadiusM * kScale);
  }
  for (const auto& [type, line] : bench.lines) {
    const double length_m = field::LengthOf(line.path) / 1e6;
    svg.Add(R"svg(<polyline points="{}" fill="none" stroke="{}" stroke-width="2.5"/>)svg",
            polyline(type, 0, length_m), ColourOf(type));
    for (int i = 0; 1.2 + 1.8 * i < length_m; ++i) {  // where it leads
      const sim::PlanePose pose = bench.PlaceOn(type, 1.2 + 1.8 * i);
      svg.Add(
          R"svg(<path d="M-6-4L4 0L-6 4z" fill="{}" transform="translate({:.1f} {:.1f}) rotate({:.0f})"/>)svg",
          ColourOf(type), x_of(pose.x_m), y_of(pose.y_m),
          -pose.heading_rad * 180 / std::numbers::pi);
    }
  }
  for (size_t i = 0; i < robots.size(); ++i) {
    const double x = x_of(robots[i].x_m);
    const double y = y_of(robots[i].y_m);
    svg.Add(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="#555" fill-opacity="0.82"/>)svg",
            x, y, kBenchRobotRadiusM * kScale);
    svg.Add(R"svg(<path d="M{:.1f} {:.1f}L{:.1f} {:.1f}" stroke="#fff" stroke-width="2"/>)svg", x,
            y, x + kBenchRobotRadiusM * kScale * std::cos(robots[i].heading_rad),
            y - kBenchRobotRadiusM * kScale * std::sin(robots[i].heading_rad));
    svg.Add(R"svg(<text x="{:.1f}" y="{:.1f}" style="fill:#fff" text-anchor="middle">{}</text>)svg",
            x, y + 16, i + 1);
  }
  for (const BenchTag& tag : bench.tags) {
    const double x = x_of(tag.x_m);
    const double y = y_of(tag.y_m);
    if (IsEntrance(tag.name)) {
      svg.Add(
          R"svg(<rect x="{:.1f}" y="{:.1f}" width="12" height="12" fill="#fff" stroke="#222" stroke-width="2"/>)svg",
          x - 6, y - 6);
    } else {
      svg.Add(
          R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="{}" fill="{}" stroke="#222" stroke-width="2"/>)svg",
          x, y, tag.name == "P" || tag.name == "Src" ? 9 : 5.5,
          tag.name == "P" || tag.name == "Src" ? "#f0e442" : "#fff");
    }
    svg.Text(x + 11, y - 9, "b", tag.name);
  }
  const double legend = kTop + kScale * height_m + 22;
  constexpr std::array<std::pair<const char*, const char*>, 3> kLegend = {
      {{kColourNest, "nest"}, {kColourA, "trail A"}, {kColourB, "trail B"}}};
  for (size_t i = 0; i < kLegend.size(); ++i) {
    const double x = kLeft + 110 * static_cast<double>(i);
    svg.Add(R"svg(<path d="M{:.1f} {:.1f}h24" stroke="{}" stroke-width="2.5"/>)svg", x, legend,
            kLegend[i].first);
    svg.Text(x + 30, legend + 4, "t", kLegend[i].second);
  }
  return svg.Take();
}

std::string DrawConcentrations(const std::string& title, const std::vector<TrailsSample>& samples,
                               const std::vector<StoryMark>& marks) {
  constexpr double kLeft = 60;
  constexpr double kWidth = 860;
  constexpr double kHeight = 260;
  constexpr double kRow = 15;  // of a label
  const auto labels = static_cast<double>(
      std::count_if(marks.begin(), marks.end(), [](const StoryMark& m) { return !m.is_change; }));
  const double top = 70 + kRow * labels;
  const double bottom = top + kHeight;
  const double end_s =
      samples.empty() ? 1 : std::max(1.0, static_cast<double>(samples.back().time_ms) / 1000);
  double most = 1;
  for (const TrailsSample& sample : samples) {
    for (const int64_t milli : sample.concentration_milli) {
      most = std::max(most, static_cast<double>(milli) / 1000);
    }
  }
  const chart::Axis y_axis = chart::AxisOver(chart::Scale::kLinear, 0, most);
  const auto x_of = [&](int64_t ms) {
    return kLeft + kWidth * static_cast<double>(ms) / 1000 / end_s;
  };
  const auto y_at = [&](double value) { return bottom - kHeight * y_axis.ShareOf(value); };
  chart::Svg svg(kLeft + kWidth + 40, bottom + 76, title);
  svg.Text(12, 48, "t", "concentration, units of energy; below: the advice on tag P");
  for (const double tick : y_axis.ticks) {
    svg.Add(R"svg(<path d="M{:.1f} {:.1f}h{:.1f}" stroke="#ddd"/>)svg", kLeft, y_at(tick), kWidth);
    svg.Text(kLeft - 6, y_at(tick) + 4, "t e", fmt::format("{:g}", tick));
  }
  for (const double tick : chart::AxisOver(chart::Scale::kLinear, 0, end_s).ticks) {
    if (tick <= end_s) {
      const double x = kLeft + kWidth * tick / end_s;
      svg.Add(R"svg(<path d="M{:.1f} {:.1f}v5" stroke="#888"/>)svg", x, bottom + 14);
      svg.Text(x, bottom + 32, "t m", fmt::format("{:g} s", tick));
    }
  }
  double label_y = 66;
  for (const StoryMark& mark : marks) {
    const double x = x_of(mark.time_ms);
    if (mark.is_change) {
      svg.Add(R"svg(<path d="M{:.1f} {:.1f}V{:.1f}" stroke="#222" stroke-dasharray="5 3"/>)svg", x,
              top - 4, bottom + 12);
      svg.Text(x + 4, top + 10, "b", mark.label);
    } else {
      svg.Add(R"svg(<path d="M{:.1f} {:.1f}V{:.1f}" stroke="#aaa" stroke-dasharray="1 3"/>)svg", x,
              label_y, bottom);
      svg.Text(x + 4, label_y + 4, "t", mark.label);
      label_y += kRow;
    }
  }
  for (size_t trail = 0; trail < kTrails; ++trail) {
    const auto y_of = [&](const TrailsSample& sample) {
      return y_at(static_cast<double>(sample.concentration_milli[trail]) / 1000);
    };
    svg.Add(R"svg(<path d="{}" fill="none" stroke="{}" stroke-width="{}"{}/>)svg",
            PathOf(samples, y_of, kLeft, kWidth, end_s), trail == 0 ? kColourA : kColourB,
            trail == 0 ? 2 : 2.4, trail == 0 ? "" : R"( stroke-dasharray="7 3")");
  }
  for (size_t i = 0; i < samples.size();) {  // of one advice
    size_t next = i + 1;
    while (next < samples.size() && samples[next].advice == samples[i].advice) {
      ++next;
    }
    const double x = x_of(samples[i].time_ms);
    const double end = next < samples.size() ? x_of(samples[next].time_ms) : kLeft + kWidth;
    svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="10" fill="{}"/>)svg", x,
            bottom + 3, end - x, ColourOf(samples[i].advice));
    i = next;
  }
  constexpr std::array<std::pair<const char*, const char*>, 3> kLegend = {
      {{kColourA, "trail A, short; advice 01"},
       {kColourB, "trail B, long (dashed); advice 10"},
       {"#bbb", "advice 00"}}};
  for (size_t i = 0; i < kLegend.size(); ++i) {
    const double x = kLeft + 250 * static_cast<double>(i);
    svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="22" height="8" fill="{}"/>)svg", x,
            bottom + 52, kLegend[i].first);
    svg.Text(x + 28, bottom + 60, "t", kLegend[i].second);
  }
  return svg.Take();
}

// Stacked means over a minute each.
std::string DrawShares(const std::string& title, const TrailsRun& run) {
  constexpr int64_t kMeanMs = 60'000;
  constexpr double kLeft = 60;
  constexpr double kWidth = 860;
  constexpr double kHeight = 180;
  constexpr double kTop = 70;
  constexpr double kBottom = kTop + kHeight;
  constexpr std::array<const char*, 3> kColours = {kColourA, kColourB, "#e5e5e5"};
  chart::Svg svg(kLeft + kWidth + 40, kBottom + 72, title);
  svg.Text(12, 48, "t", "where robots were, means over a minute");
  const double end_s = std::max(1.0, static_cast<double>(run.duration_ms) / 1000);
  const double a_robot = kHeight / std::max(1, run.robots);
  size_t begin = 0;
  while (begin < run.samples.size()) {
    const int64_t minute = run.samples[begin].time_ms / kMeanMs;
    std::array<double, 3> means{};
    size_t end = begin;
    for (; end < run.samples.size() && run.samples[end].time_ms / kMeanMs == minute; ++end) {
      const auto [a, b] = run.samples[end].robots_on;
      means[0] += a;
      means[1] += b;
      means[2] += run.robots - a - b;
    }
    const auto x_of = [&](int64_t ms) {
      return kLeft + kWidth * std::min(1.0, static_cast<double>(ms) / 1000 / end_s);
    };
    const double x = x_of(minute * kMeanMs);
    const double width = x_of((minute + 1) * kMeanMs) - x;
    double y = kBottom;
    for (size_t i = 0; i < means.size(); ++i) {
      const double height = a_robot * means[i] / static_cast<double>(end - begin);
      y -= height;
      svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.2f}" height="{:.1f}" fill="{}"/>)svg", x,
              y, width + 0.2, height, kColours[i]);
    }
    begin = end;
  }
  for (int robots = 0; robots <= run.robots; ++robots) {
    const double y = kBottom - a_robot * robots;
    svg.Add(R"svg(<path d="M{:.1f} {:.1f}h-4" stroke="#888"/>)svg", kLeft, y);
    svg.Text(kLeft - 7, y + 4, "t e", fmt::format("{}", robots));
  }
  for (const double tick : chart::AxisOver(chart::Scale::kLinear, 0, end_s / 60).ticks) {
    if (tick <= end_s / 60) {
      const double x = kLeft + kWidth * tick * 60 / end_s;
      svg.Add(R"svg(<path d="M{:.1f} {:.1f}v5" stroke="#888"/>)svg", x, kBottom);
      svg.Text(x, kBottom + 18, "t m", fmt::format("{:g} min", tick));
    }
  }
  constexpr std::array<const char*, 3> kLabels = {"on trail A, short", "on trail B, long",
                                                  "in the nest or on their way home"};
  for (size_t i = 0; i < kLabels.size(); ++i) {
    const double x = kLeft + 190 * static_cast<double>(i);
    svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="22" height="10" fill="{}"/>)svg", x,
            kBottom + 40, kColours[i]);
    svg.Text(x + 28, kBottom + 49, "t", kLabels[i]);
  }
  return svg.Take();
}

}  // namespace pheromone::swarm
