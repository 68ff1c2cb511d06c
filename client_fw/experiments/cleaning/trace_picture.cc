#include "client_fw/experiments/cleaning/trace_picture.h"

#include <algorithm>
#include <array>
#include <vector>

#include "client_fw/swarm/svg.h"

namespace pheromone::swarm {
namespace {

using verify::CleaningAction;
using verify::CleaningMoment;

// As deploy/pictures/figure_style.py.
constexpr std::array<const char*, 6> kRobots = {"#0072b2", "#e69f00", "#009e73",
                                                "#cc79a7", "#56b4e9", "#7f6000"};
constexpr char kVermilion[] = "#d55e00";
constexpr double kLeft = 76;
constexpr double kRight = 24;
constexpr double kTop = 64;
constexpr double kPlot = 860;
constexpr double kBar = 7;  // of a robot, below the soil
constexpr double kPlan = 170;

// Who was where: a robot in a zone, cleaning or not.
struct Stay {
  size_t robot;
  size_t zone;
  int from;
  int to;
  bool is_cleaning;
};

class TracePicture {
 public:
  TracePicture(const CleaningFloor& floor, const ProofAnswer& answer)
      : floor_(floor),
        answer_(answer),
        trace_(answer.result.trace),
        zones_(static_cast<size_t>(floor.grid.zones())),
        // What repeats lasts until it begins again.
        end_(std::max(1, trace_.back().time +
                             (answer.result.repeats_from != 0 ? trace_.back().step.passed : 0))),
        plan_(floor.has_places ? kPlan : 0),
        row_(zones_ <= 20 ? 36 : 24),
        svg_(kLeft + kPlot + kRight, kTop + plan_ + row_ * static_cast<double>(zones_) + 60,
             Claim(floor, answer.question)) {}

  std::string Draw() {
    svg_.Text(12, 44, "t", floor_.name + ": " + Outcome(answer_));
    if (floor_.has_places) {
      DrawPlan();
    }
    DrawRepeat();
    DrawSoil();
    for (const Stay& stay : Stays()) {
      DrawStay(stay);
    }
    DrawAxis();
    DrawEnd();
    DrawLegend();
    return svg_.Take();
  }

 private:
  double X(int time) const { return kLeft + kPlot * time / end_; }
  double Top(size_t zone) const { return kTop + plan_ + row_ * static_cast<double>(zone); }
  double Floor(size_t zone) const { return Top(zone) + row_ - kBar - 2; }
  double Soil(size_t zone, int percent) const {
    return Floor(zone) - (row_ - kBar - 5) * percent / 100;
  }
  double Bottom() const { return Top(zones_); }
  static const char* Colour(size_t robot) { return kRobots[robot % kRobots.size()]; }
  int limit() const {
    return answer_.question.kind == ProofKind::kClean ? floor_.dirty.below : floor_.kept.below;
  }
  bool is_closed(size_t zone) const { return (floor_.limits.closed >> zone & 1) != 0; }
  bool has_soil() const {
    return answer_.question.kind != ProofKind::kForgotten &&
           answer_.question.kind != ProofKind::kCrash;
  }
  int start_percent() const {
    return answer_.question.kind == ProofKind::kClean ? floor_.dirty.start : floor_.kept.start;
  }

  // The floor from above: who sees whom, rates, and where robots start.
  void DrawPlan() {
    const CleaningGrid& grid = floor_.grid;
    const double scale =
        std::min((kPlan - 30) / grid.height_m(), kPlot / std::max(grid.width_m(), 0.1));
    const auto x = [&](int zone) { return kLeft + scale * grid.CentreX(zone); };
    const auto y = [&](int zone) { return kTop + scale * (grid.height_m() - grid.CentreY(zone)); };
    const verify::CleaningNeighbours beside = floor_.limits.Floor();
    const double half = std::min(0.42 * scale * grid.zone_m, 30.0);
    for (int zone = 0; zone < grid.zones(); ++zone) {
      for (const uint8_t other : beside[static_cast<size_t>(zone)]) {
        svg_.Add(R"svg(<path d="M{:.1f} {:.1f}L{:.1f} {:.1f}" stroke="#999"/>)svg", x(zone),
                 y(zone), x(other), y(other));
      }
    }
    for (int zone = 0; zone < grid.zones(); ++zone) {
      const bool closed = is_closed(static_cast<size_t>(zone));
      svg_.Add(
          R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" stroke="#666"/>)svg",
          x(zone) - half, y(zone) - half, 2 * half, 2 * half, closed ? "#ccc" : "white");
      svg_.Text(x(zone), y(zone) + 1, "b m", std::to_string(zone + 1));
      svg_.Text(x(zone), y(zone) + 12, "t m",
                closed ? "closed" : std::to_string(grid.RatePercent(zone)) + " %");
    }
    for (size_t robot = 0; robot < static_cast<size_t>(floor_.limits.robots); ++robot) {
      const int zone = trace_.front().state.cleaners[robot].zone;
      svg_.Add(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="5" fill="{}"/>)svg",
               x(zone) - half + 7 + 11 * static_cast<double>(robot), y(zone) - half + 7,
               Colour(robot));
    }
  }

  void DrawRepeat() {
    const size_t from = answer_.result.repeats_from;
    if (from != 0) {
      const double x = X(trace_[from].time);
      svg_.Add(
          R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="#fdece0"/>)svg", x,
          Top(0), kLeft + kPlot - x, Bottom() - Top(0));
      svg_.Text(kLeft + kPlot, Top(0) - 4, "t e", "this part repeats for ever");
    }
  }

  void DrawSoil() {
    const std::vector<std::vector<int>> soil =
        verify::SoilOn(trace_, floor_.limits.rates_percent, start_percent());
    for (size_t zone = 0; zone < zones_; ++zone) {
      svg_.Text(kLeft - 8, Floor(zone), "e", "zone " + std::to_string(zone + 1));
      if (is_closed(zone)) {
        svg_.Text(kLeft + 4, Floor(zone), "t", "closed");
      } else if (has_soil()) {
        DrawArea(zone, soil);
        svg_.Add(
            R"svg(<path d="M{:.1f} {:.1f}h{:.1f}" stroke="{}" stroke-dasharray="4 3" stroke-width="0.8"/>)svg",
            kLeft, Soil(zone, limit()), kPlot, kVermilion);
      }
      svg_.Add(R"svg(<path d="M{:.1f} {:.1f}h{:.1f}" stroke="#ddd"/>)svg", kLeft, Top(zone), kPlot);
    }
  }

  void DrawArea(size_t zone, const std::vector<std::vector<int>>& soil) {
    std::string path = fmt::format("M{:.1f} {:.1f}", X(0), Floor(zone));
    for (size_t i = 0; i < trace_.size(); ++i) {
      path += fmt::format("H{:.1f}V{:.1f}", X(trace_[i].time), Soil(zone, soil[i][zone]));
    }
    svg_.Add(R"svg(<path d="{}H{:.1f}V{:.1f}Z" fill="#bbb"/>)svg", path, X(end_), Floor(zone));
  }

  std::vector<Stay> Stays() const {
    std::vector<Stay> stays;
    for (size_t robot = 0; robot < static_cast<size_t>(floor_.limits.robots); ++robot) {
      for (size_t i = 0; i < trace_.size(); ++i) {
        const verify::Cleaner& it = trace_[i].state.cleaners[robot];
        const int from = trace_[i].time;
        const int to = i + 1 < trace_.size() ? trace_[i + 1].time : end_;
        if (it.phase == verify::CleanerPhase::kGone) {
          break;
        }
        if (!stays.empty() && stays.back().robot == robot && stays.back().zone == it.zone &&
            stays.back().is_cleaning == it.is_cleaning()) {
          stays.back().to = to;
        } else {
          stays.push_back({robot, it.zone, from, to, it.is_cleaning()});
        }
      }
    }
    return stays;
  }

  void DrawStay(const Stay& stay) {
    const double robots = std::max(1, floor_.limits.robots);
    const double height = kBar / robots;
    const double y = Floor(stay.zone) + 1 + height * static_cast<double>(stay.robot);
    const double width = std::max(X(stay.to) - X(stay.from), 1.0);
    svg_.Add(
        R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" opacity="{}"/>)svg",
        X(stay.from), y, width, stay.is_cleaning ? height : height / 3, Colour(stay.robot),
        stay.is_cleaning ? "1" : "0.6");
  }

  void DrawAxis() {
    int step = 1;
    for (const int next : {5, 10, 20, 50, 100, 200, 500, 1'000, 5'000}) {
      step = end_ / step > 20 ? next : step;
    }
    for (int time = 0; time <= end_; time += step) {
      svg_.Add(R"svg(<path d="M{:.1f} {:.1f}v5" stroke="#666"/>)svg", X(time), Bottom());
      svg_.Text(X(time), Bottom() + 18, "t m", std::to_string(time));
    }
    svg_.Text(kLeft + kPlot / 2, Bottom() + 34, "m", "time, units");
  }

  void DrawEnd() {
    if (answer_.result.repeats_from == 0) {
      svg_.Add(R"svg(<path d="M{0:.1f} {1:.1f}V{2:.1f}" stroke="{3}" stroke-width="2"/>)svg",
               X(end_), Top(0), Bottom(), kVermilion);
      svg_.Text(X(end_), Top(0) - 4, "b e", answer_.result.wrong);
    }
  }

  void DrawLegend() {
    double x = kLeft;
    const double y = Bottom() + 50;
    for (size_t robot = 0; robot < static_cast<size_t>(floor_.limits.robots); ++robot) {
      svg_.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="14" height="7" fill="{}"/>)svg", x, y - 8,
               Colour(robot));
      svg_.Text(x + 18, y, "t",
                std::string("robot ") + static_cast<char>('A' + static_cast<int>(robot)));
      x += 78;
    }
    svg_.Text(x, y, "t",
              has_soil() ? fmt::format("full bars: it cleans; thin: it is there; grey: soil; "
                                       "dashed: {} %",
                                       limit())
                         : "full bars: it cleans; thin: it is there");
  }

  const CleaningFloor& floor_;
  const ProofAnswer& answer_;
  const std::vector<CleaningMoment>& trace_;
  size_t zones_;
  int end_;
  double plan_;
  double row_;
  Svg svg_;
};

}  // namespace

std::string DrawTrace(const CleaningFloor& floor, const ProofAnswer& answer) {
  return TracePicture(floor, answer).Draw();
}

}  // namespace pheromone::swarm
