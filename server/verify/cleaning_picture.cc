#include "server/verify/cleaning_picture.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "server/chart/svg.h"

namespace pheromone::verify {
namespace {

constexpr double kLeft = 70;
constexpr double kTop = 50;
constexpr double kRow = 24;
constexpr double kWidth = 720;
constexpr std::array<const char*, kMaxCleaners> kColours = {"#1f5fa8", "#c2571a", "#3b7d3b",
                                                            "#7a4a9e"};

}  // namespace

std::string TracePicture(const CleaningLimits& limits, const CleaningResult& result) {
  const int zones = limits.columns * limits.rows;
  const int end = result.trace.empty() ? 1 : std::max(result.trace.back().time, 1);
  const double unit = kWidth / (end + 1);
  const double bottom = kTop + kRow * zones;
  const auto x_of = [&](double time) { return kLeft + unit * time; };
  // Robots that are in one zone are drawn beside each other.
  const auto y_of = [&](size_t zone, size_t robot) {
    return kTop + kRow * (static_cast<double>(zone) + 0.25 +
                          0.5 * static_cast<double>(robot) / std::max(limits.robots - 1, 1));
  };
  chart::Svg svg(kLeft + kWidth + 20, bottom + 40, result.wrong);
  if (result.repeats_from != 0) {
    const double from = x_of(result.trace[result.repeats_from].time);
    svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="#eee"/>)svg",
            from, kTop, kLeft + kWidth - from, kRow * zones);
    svg.Text(from, kTop - 4, "t", "for ever");
  }
  for (int zone = 0; zone < zones; ++zone) {
    svg.Add(R"svg(<path d="M{:.1f} {:.1f}h{:.1f}" stroke="#ddd"/>)svg", kLeft, kTop + kRow * zone,
            kWidth);
    svg.Text(kLeft - 8, kTop + kRow * (zone + 0.7), "t e", "zone " + std::to_string(zone + 1));
  }
  const int step = std::max(1, (end + 9) / 10);
  for (int time = 0; time <= end; time += step) {
    svg.Text(x_of(time), bottom + 16, "t m", std::to_string(time));
  }
  std::array<std::string, kMaxCleaners> ways;
  std::array<int, kMaxCleaners> cleaning_since{};
  for (size_t i = 0; i < result.trace.size(); ++i) {
    const CleaningMoment& moment = result.trace[i];
    for (size_t robot = 0; robot < static_cast<size_t>(limits.robots); ++robot) {
      const Cleaner& it = moment.state.cleaners[robot];
      const bool acts =
          i > 0 && moment.step.robot == robot && moment.step.action < CleaningAction::kSoils;
      if (it.phase < CleanerPhase::kBroken && (i == 0 || acts)) {
        const double x = x_of(moment.time);
        ways[robot] += fmt::format(
            "{}{:.1f} {:.1f}", ways[robot].empty() ? "M" : "L",
            x + (acts && moment.step.action == CleaningAction::kMoves ? unit * limits.move_min : 0),
            y_of(it.zone, robot));
      }
      if (acts && moment.step.action == CleaningAction::kBreaksDown) {
        svg.Text(x_of(moment.time), y_of(moment.step.zone, robot) + 4, "b m", "×");
      }
      const bool begins = acts && moment.step.action == CleaningAction::kClaims;
      if (begins) {
        cleaning_since[robot] = moment.time;
      }
      const bool ends = acts && moment.step.action == CleaningAction::kFinishes;
      if (ends || (i + 1 == result.trace.size() && it.is_cleaning())) {
        svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="8" fill="{}"/>)svg",
                x_of(cleaning_since[robot]), y_of(ends ? moment.step.zone : it.zone, robot) - 4,
                unit * std::max(0.3, static_cast<double>(moment.time - cleaning_since[robot])),
                kColours[robot]);
      }
    }
  }
  for (size_t robot = 0; robot < static_cast<size_t>(limits.robots); ++robot) {
    svg.Add(R"svg(<path d="{}" fill="none" stroke="{}"/>)svg", ways[robot], kColours[robot]);
    svg.Add(R"svg(<text x="{:.1f}" y="{:.1f}" class="t" fill="{}">{}</text>)svg",
            kLeft + 60 * static_cast<double>(robot), bottom + 34, kColours[robot],
            fmt::format("robot {}", static_cast<char>('A' + robot)));
  }
  return svg.Take();
}

}  // namespace pheromone::verify
