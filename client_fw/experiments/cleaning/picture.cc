#include "client_fw/experiments/cleaning/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server/chart/axis.h"
#include "server/chart/svg.h"

namespace pheromone::swarm {
namespace {

constexpr std::array<const char*, 8> kRobotColours = {"#1f5fa8", "#c2571a", "#3b7d3b", "#7a4a9e",
                                                      "#8c6d1f", "#1f8a8a", "#a83279", "#555555"};
constexpr const char* kSlowColour = "#c9b48a";
constexpr const char* kFastColour = "#a3783b";
constexpr const char* kThresholdColour = "#c00000";

const char* ColourOfRobot(int robot) {
  return kRobotColours[static_cast<size_t>(robot) % kRobotColours.size()];
}

// From white over yellow and red to black, 0 to 1: brightness falls all the way.
std::string Heat(double share) {
  const double at = std::clamp(share, 0.0, 1.0);
  const auto part = [](double value) {
    return static_cast<int>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", part(2.2 - 2 * at), part(1.05 - 1.1 * at),
                     part(0.9 - 2.2 * at));
}

// From white to grey, 0 to 1: behind text and tracks.
std::string Tint(double share) {
  const auto level = static_cast<int>(std::lround(255 - 40 * std::clamp(share, 0.0, 1.0)));
  return fmt::format("#{0:02x}{0:02x}{0:02x}", level);
}

// Time along a picture, with ticks below it.
struct TimeAxis {
  double left;
  double width;
  double end_s;

  double X(int64_t ms) const { return left + width * static_cast<double>(ms) / 1000 / end_s; }

  void Draw(chart::Svg* svg, double top, double bottom) const {
    for (const double tick : chart::AxisOver(chart::Scale::kLinear, 0, end_s).ticks) {
      if (tick <= end_s) {
        const double x = left + width * tick / end_s;
        svg->Add(R"svg(<path d="M{:.1f} {:.1f}V{:.1f}" stroke="#ddd"/>)svg", x, top, bottom);
        svg->Text(x, bottom + 16, "t m", fmt::format("{:g} s", tick));
      }
    }
  }
};

std::string TitleOf(const CleaningExperiment& experiment, const std::string& what) {
  return fmt::format("{}: {} × {} zones, {} robots", what, experiment.grid.columns,
                     experiment.grid.rows, experiment.robots);
}

std::string DrawCurves(const CleaningExperiment& experiment, const CleaningRun& run) {
  constexpr double kTop = 66;
  constexpr double kRow = 46;
  constexpr double kCurve = 34;  // of a row
  const int zones = experiment.grid.zones();
  const double bottom = kTop + kRow * zones;
  const TimeAxis time{92, 820, static_cast<double>(experiment.duration_ms) / 1000};
  const double threshold = experiment.soil.threshold_percent;
  double most = threshold;
  for (int zone = 0; zone < zones; ++zone) {
    most = std::max(most, HighestPercent(SoilOf(experiment.grid, experiment.soil, zone,
                                                run.cleanings, experiment.duration_ms)));
  }
  chart::Svg svg(time.left + time.width + 70, bottom + 54,
                 TitleOf(experiment, "Soil of each zone"));
  svg.Text(
      12, 48, "t",
      fmt::format("red: the threshold, {:g} %; dark: zones that soil by 10 % in {:g} s, light: "
                  "by 5 %; bars: cleaned by a robot",
                  threshold, static_cast<double>(experiment.soil.step_ms()) / 1000));
  time.Draw(&svg, kTop, bottom);
  for (int zone = 0; zone < zones; ++zone) {
    const double base = kTop + kRow * zone + kCurve + 4;
    const auto y_of = [=](double percent) { return base - kCurve * percent / most; };
    const std::vector<SoilStep> soil =
        SoilOf(experiment.grid, experiment.soil, zone, run.cleanings, experiment.duration_ms);
    std::string path = fmt::format("M{:.1f} {:.1f}", time.X(0), base);
    for (const SoilStep& step : soil) {
      path += fmt::format("H{:.1f}V{:.1f}", time.X(step.time_ms), y_of(step.percent));
    }
    path += fmt::format("H{:.1f}V{:.1f}Z", time.X(experiment.duration_ms), base);
    svg.Add(R"svg(<path d="{}" fill="{}"/>)svg", path,
            experiment.grid.RatePercent(zone) > 5 ? kFastColour : kSlowColour);
    svg.Add(R"svg(<path d="M{:.1f} {:.1f}h{:.1f}" stroke="{}" stroke-dasharray="4 3"/>)svg",
            time.left, y_of(threshold), time.width, kThresholdColour);
    for (const Cleaning& cleaning : run.cleanings) {
      if (cleaning.zone == zone) {
        const double x = time.X(cleaning.begin_ms);
        svg.Add(
            R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="5" fill="{}" opacity="{}"/>)svg",
            x, base, std::max(1.0, time.X(cleaning.end_ms) - x), ColourOfRobot(cleaning.robot),
            cleaning.is_done ? 1.0 : 0.35);
      }
    }
    svg.Text(time.left - 8, base, "e", fmt::format("zone {}", zone + 1));
    svg.Text(time.left + time.width + 8, base, "t",
             fmt::format("≤ {:.0f} %", HighestPercent(soil)));
  }
  const int robots = std::min(experiment.robots, static_cast<int>(kRobotColours.size()));
  for (int robot = 0; robot < robots; ++robot) {
    const double x = time.left + 90 * robot;
    svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="14" height="5" fill="{}"/>)svg", x,
            bottom + 33, ColourOfRobot(robot));
    svg.Text(x + 19, bottom + 40, "t", fmt::format("robot {}", robot + 1));
  }
  return svg.Take();
}

// A row for each zone, a rectangle for each level that lasts.
std::string DrawHeatMap(const CleaningExperiment& experiment, const CleaningRun& run) {
  constexpr double kTop = 66;
  const int zones = experiment.grid.zones();
  const double row = std::clamp(640.0 / zones, 2.0, 14.0);
  const double bottom = kTop + row * zones;
  const TimeAxis time{70, 820, static_cast<double>(experiment.duration_ms) / 1000};
  chart::Svg svg(time.left + time.width + 130, bottom + 40,
                 TitleOf(experiment, "Soil of each zone"));
  svg.Text(
      12, 48, "t",
      fmt::format("a row for each zone, by number; red line in the scale: the threshold, {:g} %",
                  experiment.soil.threshold_percent));
  for (int zone = 0; zone < zones; ++zone) {
    const double y = kTop + row * zone;
    const std::vector<SoilStep> soil =
        SoilOf(experiment.grid, experiment.soil, zone, run.cleanings, experiment.duration_ms);
    for (size_t i = 0; i < soil.size(); ++i) {
      const int64_t end_ms = i + 1 < soil.size() ? soil[i + 1].time_ms : experiment.duration_ms;
      const double x = time.X(soil[i].time_ms);
      svg.Add(R"svg(<path d="M{:.1f} {:.1f}H{:.1f}v{:.1f}H{:.1f}z" fill="{}"/>)svg", x, y,
              time.X(end_ms), row, x, Heat(soil[i].percent / 100));
    }
    if (zone == 0 || (zone + 1) % experiment.grid.rows == 0) {
      svg.Text(time.left - 6, y + row, "t e", fmt::format("{}", zone + 1));
    }
  }
  time.Draw(&svg, bottom, bottom + 3);
  const double scale = time.left + time.width + 40;
  const double height = std::min(200.0, bottom - kTop);
  for (int percent = 0; percent < 100; percent += 2) {
    const double y = kTop + height * (98 - percent) / 100;
    svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="16" height="{:.1f}" fill="{}"/>)svg", scale, y,
            height / 50 + 0.3, Heat((percent + 1) / 100.0));
    if (percent % 20 == 0) {
      svg.Text(scale + 22, y + height / 50, "t", fmt::format("{} %", percent));
    }
  }
  svg.Add(R"svg(<path d="M{:.1f} {:.1f}h28" stroke="{}" stroke-width="2"/>)svg", scale - 6,
          kTop + height * (100 - experiment.soil.threshold_percent) / 100, kThresholdColour);
  return svg.Take();
}

}  // namespace

std::string DrawSoil(const CleaningExperiment& experiment, const CleaningRun& run) {
  return experiment.grid.zones() <= kMaxSoilCurves ? DrawCurves(experiment, run)
                                                   : DrawHeatMap(experiment, run);
}

std::string DrawFloor(const CleaningExperiment& experiment, const CleaningRun& run) {
  constexpr double kLeft = 24;
  constexpr double kTop = 66;
  const CleaningGrid& grid = experiment.grid;
  const double side = std::clamp(720.0 / std::max(grid.columns, grid.rows), 36.0, 150.0);
  const auto x_of = [&](double x_m) { return kLeft + side * x_m / grid.zone_m; };
  const auto y_of = [&](double y_m) { return kTop + side * (grid.rows - y_m / grid.zone_m); };
  const double bottom = y_of(0);
  std::vector<CleaningGap> gaps;
  std::vector<int> counts(static_cast<size_t>(grid.zones()));
  int64_t least_ms = INT64_MAX;
  int64_t most_ms = 0;
  for (int zone = 0; zone < grid.zones(); ++zone) {
    gaps.push_back(WorstGap(zone, run.cleanings, experiment.duration_ms));
    least_ms = std::min(least_ms, gaps.back().ms);
    most_ms = std::max(most_ms, gaps.back().ms);
  }
  least_ms = std::min(least_ms, most_ms * 3 / 4);  // zones that are nearly alike look it
  for (const Cleaning& cleaning : run.cleanings) {
    counts[static_cast<size_t>(cleaning.zone)] += cleaning.is_done ? 1 : 0;
  }
  chart::Svg svg(std::max(480.0, x_of(grid.columns * grid.zone_m) + kLeft), bottom + 44,
                 TitleOf(experiment, "Cleanings of each zone"));
  const bool with_text = side >= 60;
  svg.Text(12, 48, "t",
           with_text ? "number, cleanings, longest time without one; the darker, the longer"
                     : "the longest time without a cleaning, s; the darker, the longer");
  for (int zone = 0; zone < grid.zones(); ++zone) {
    const auto at = static_cast<size_t>(zone);
    const double x = x_of(grid.CentreX(zone)) - side / 2;
    const double y = y_of(grid.CentreY(zone)) - side / 2;
    const double gap_s = static_cast<double>(gaps[at].ms) / 1000;
    const double share = static_cast<double>(gaps[at].ms - least_ms) /
                         static_cast<double>(std::max<int64_t>(1, most_ms - least_ms));
    svg.Add(
        R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" stroke="#888"/>)svg",
        x, y, side, side, Tint(share));
    if (with_text) {
      svg.Text(x + 6, y + 17, "b",
               fmt::format("{}{}", zone + 1, grid.RatePercent(zone) > 5 ? " (10 %)" : ""));
      svg.Text(x + 6, y + side - 22, "t", fmt::format("{} times", counts[at]));
      svg.Text(x + 6, y + side - 7, "t", fmt::format("gap {:.0f} s", gap_s));
    } else {
      svg.Text(x + side / 2, y + side / 2 + 4, "t m", fmt::format("{:.0f}", gap_s));
    }
  }
  if (run.tracks.size() > kMaxTracks) {
    return svg.Take();
  }
  for (size_t robot = 0; robot < run.tracks.size(); ++robot) {
    std::string points;
    const double aside =
        4 * (static_cast<double>(robot) - static_cast<double>(run.tracks.size() - 1) / 2);
    for (const sim::PlanePose& pose : run.tracks[robot]) {
      points += fmt::format("{:.1f},{:.1f} ", x_of(pose.x_m) + aside, y_of(pose.y_m) + aside);
    }
    svg.Add(
        R"svg(<polyline points="{}" fill="none" stroke="{}" stroke-width="1.2" opacity="0.5"/>)svg",
        points, ColourOfRobot(static_cast<int>(robot)));
    const double x = kLeft + 110 * static_cast<double>(robot);
    svg.Add(R"svg(<path d="M{:.1f} {:.1f}h16" stroke="{}" stroke-width="2"/>)svg", x, bottom + 24,
            ColourOfRobot(static_cast<int>(robot)));
    svg.Text(x + 21, bottom + 28, "t", fmt::format("robot {}", robot + 1));
  }
  return svg.Take();
}

}  // namespace pheromone::swarm
