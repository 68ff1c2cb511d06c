#include "client_fw/experiments/bridge/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "server/chart/svg.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kMinuteMs = 60'000;
constexpr const char* kShortColour = "#2166ac";
constexpr const char* kLongColour = "#b2182b";
constexpr const char* kUndecidedColour = "#bbbbbb";
constexpr const char* kTrailColour = "#e08214";

// A plot of shares: x from 0 to `most`, y from 0 to 1.
struct Plot {
  double left;
  double top;
  double width;
  double height;
  double most;

  double X(double value) const { return left + value / most * width; }
  double Y(double share) const { return top + (1 - share) * height; }
};

void DrawFrame(chart::Svg* svg, const Plot& plot) {
  for (const double share : {0.0, 0.2, 0.5, 0.8, 1.0}) {
    svg->Add(R"svg(<path d="M{:.1f} {:.1f}h{:.1f}" stroke="#ddd"/>)svg", plot.left, plot.Y(share),
             plot.width);
    svg->Text(plot.left - 5, plot.Y(share) + 4, "t e", fmt::format("{:.0f} %", share * 100));
  }
}

std::string Points(const Plot& plot, const std::vector<std::pair<double, double>>& points) {
  std::string text;
  for (const auto& [x, share] : points) {
    text += fmt::format("{:.1f},{:.1f} ", plot.X(x), plot.Y(share));
  }
  return text;
}

const char* ColourOf(Outcome outcome) {
  switch (outcome) {
    case Outcome::kShort:
      return kShortColour;
    case Outcome::kLong:
      return kLongColour;
    case Outcome::kUndecided:
      break;
  }
  return kUndecidedColour;
}

double Minutes(int64_t ms) {
  return static_cast<double>(ms) / kMinuteMs;
}

void DrawSharePanel(chart::Svg* svg, const BridgeSeries& series, const Plot& plot) {
  DrawFrame(svg, plot);
  const int64_t duration_ms = series.experiment.duration_ms;
  for (int minute = 0; minute <= plot.most; minute += 5) {
    svg->Text(plot.X(minute), plot.Y(0) + 16, "t m", fmt::format("{} min", minute));
  }
  for (const BridgeRun& run : series.runs) {
    std::vector<std::pair<double, double>> points;
    for (int64_t ms = 0; ms < duration_ms; ms += kMinuteMs) {
      if (const std::optional<double> share = ShortShare(run.choices, ms, ms + kMinuteMs)) {
        points.emplace_back(Minutes(ms) + 0.5, *share);
      }
    }
    svg->Add(R"svg(<polyline points="{}" fill="none" stroke="{}" opacity="0.35"/>)svg",
             Points(plot, points), ColourOf(run.outcome));
  }
  std::vector<std::pair<double, double>> mean;
  std::vector<std::pair<double, double>> band;
  std::vector<std::pair<double, double>> lower;
  for (int64_t ms = 0; ms < duration_ms; ms += kMinuteMs) {
    const ShareSpread share = ShareOf(series, ms, ms + kMinuteMs);
    const double x = Minutes(ms) + 0.5;
    mean.emplace_back(x, share.mean);
    band.emplace_back(x, std::min(1.0, share.mean + share.deviation));
    lower.emplace_back(x, std::max(0.0, share.mean - share.deviation));
  }
  band.insert(band.end(), lower.rbegin(), lower.rend());
  svg->Add(R"svg(<polygon points="{}" fill="#333" opacity="0.10"/>)svg", Points(plot, band));
  svg->Add(R"svg(<polyline points="{}" fill="none" stroke="#111" stroke-width="2.5"/>)svg",
           Points(plot, mean));
  const BridgeSummary s = Summarise(series);
  svg->Text(plot.left, plot.top - 8, "b",
            fmt::format("{}: {} short, {} long, {} undecided", series.experiment.name,
                        s.ended_short, s.ended_long, s.runs - s.ended_short - s.ended_long));
}

void DrawCorridors(chart::Svg* svg, const BridgeArena& arena, const auto& x_of, const auto& y_of) {
  for (const auto corridor : {BridgeArena::kNestStem, BridgeArena::kShortBranch,
                              BridgeArena::kLongBranch, BridgeArena::kFoodStem}) {
    std::string points;
    for (const Lane::Point& point : arena.lane(corridor, true).points()) {
      points += fmt::format("{:.1f},{:.1f} ", x_of(point.x_m), y_of(point.y_m));
    }
    svg->Add(R"svg(<polyline points="{}" fill="none" stroke="#888" stroke-dasharray="5 4"/>)svg",
             points);
  }
  for (const bool food : {false, true}) {
    const Lane& stem = arena.lane(food ? BridgeArena::kFoodStem : BridgeArena::kNestStem, !food);
    const Lane::Point end = stem.points().front();
    svg->Add(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="7" fill="{}"/>)svg", x_of(end.x_m),
             y_of(end.y_m), food ? "#1b7837" : "#543005");
    svg->Text(x_of(end.x_m), y_of(end.y_m) - 16, "b m", food ? "food" : "nest");
  }
}

void DrawMoment(chart::Svg* svg, const BridgeMoment& moment, double left, double top,
                double scale) {
  BridgeSimulation simulation(moment.experiment, moment.seed);
  simulation.RunTo(moment.time_ms);
  const field::FieldConfig field = EngineConfigOf(moment.experiment).field;
  const double height_m = static_cast<double>(field.map.height_um) / 1e6;
  const auto x_of = [=](double x_m) { return left + x_m * scale; };
  const auto y_of = [=](double y_m) { return top + (height_m - y_m) * scale; };
  const field::PheromoneLaw law = field.pheromones.front();
  std::vector<std::pair<field::NodeIndex, double>> nodes;
  simulation.service().Inspect([&](const engine::Engine& engine) {
    engine.field().VisitLevels(law.type, static_cast<uint64_t>(moment.time_ms),
                               [&](field::NodeIndex node, uint32_t level) {
                                 nodes.emplace_back(node,
                                                    static_cast<double>(level) / law.max_level());
                               });
  });
  std::sort(nodes.begin(), nodes.end());
  DrawCorridors(svg, simulation.arena(), x_of, y_of);
  const double cell_px = static_cast<double>(field.map.cell_um) / 1e6 * scale;
  for (const auto& [node, share] : nodes) {
    const field::PointUm at = field.map.PositionOf(node);
    svg->Add(
        R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" opacity="{:.2f}"/>)svg",
        x_of(static_cast<double>(at.x) / 1e6) - cell_px / 2,
        y_of(static_cast<double>(at.y) / 1e6) - cell_px / 2, cell_px, cell_px, kTrailColour,
        0.15 + 0.85 * share);
  }
  for (size_t i = 0; i < simulation.robots().size(); ++i) {
    if (simulation.released(i)) {
      const sim::PlanePose& pose = simulation.robots()[i].pose();
      svg->Add(
          R"svg(<path transform="translate({:.1f} {:.1f}) rotate({:.1f})" d="M7 0L-5 5L-5 -5Z" fill="#2d004b"/>)svg",
          x_of(pose.x_m), y_of(pose.y_m), -pose.heading_rad * 180 / std::numbers::pi);
    }
  }
  svg->Text(left + scale, top + 4, "b", moment.caption);
}

}  // namespace

std::string DrawShares(const std::vector<BridgeSeries>& all) {
  constexpr double kWidth = 330;
  constexpr double kHeight = 170;
  constexpr size_t kColumns = 2;
  const size_t rows = (all.size() + kColumns - 1) / kColumns;
  chart::Svg svg(30 + kColumns * (kWidth + 60), 60 + static_cast<double>(rows) * (kHeight + 60),
                 "Choices of the short branch in each minute");
  svg.Text(12, 44, "t",
           "Thin: each swarm, blue if it ended on the short branch, red on the long one, grey if "
           "undecided. Bold: mean and standard deviation.");
  for (size_t i = 0; i < all.size(); ++i) {
    const size_t row = i / kColumns;
    const Plot plot{50 + static_cast<double>(i % kColumns) * (kWidth + 60),
                    84 + static_cast<double>(row) * (kHeight + 60), kWidth, kHeight,
                    Minutes(all[i].experiment.duration_ms)};
    DrawSharePanel(&svg, all[i], plot);
  }
  return svg.Take();
}

std::string DrawOutcomes(const std::vector<BridgeSeries>& all) {
  constexpr double kRow = 24;
  constexpr double kBarLeft = 170;
  constexpr double kBar = 260;
  constexpr double kLeastLabelled = 14;  // a number of two digits fits
  constexpr double kDotsLeft = 490;
  constexpr double kDots = 260;
  const double bottom = 74 + kRow * static_cast<double>(all.size());
  chart::Svg svg(kDotsLeft + kDots + 60, bottom + 44, "Where the swarms ended");
  svg.Text(kBarLeft, 54, "t", "share of the swarms: short, undecided, long");
  svg.Text(kDotsLeft, 54, "t", "each swarm's choices of the short branch, last quarter");
  for (const double share : {0.0, 0.2, 0.5, 0.8, 1.0}) {
    const double x = kDotsLeft + share * kDots;
    svg.Add(R"svg(<path d="M{:.1f} 62V{:.1f}" stroke="#ddd"/>)svg", x, bottom);
    svg.Text(x, bottom + 16, "t m", fmt::format("{:.0f} %", share * 100));
  }
  double y = 66;
  for (const BridgeSeries& series : all) {
    const BridgeSummary s = Summarise(series);
    svg.Text(kBarLeft - 10, y + 15, "e", series.experiment.name);
    double x = kBarLeft;
    const std::array<std::pair<int, Outcome>, 3> parts = {
        std::pair{s.ended_short, Outcome::kShort},
        std::pair{s.runs - s.ended_short - s.ended_long, Outcome::kUndecided},
        std::pair{s.ended_long, Outcome::kLong}};
    for (const auto& [count, outcome] : parts) {
      const double width = kBar * count / std::max(1, s.runs);
      svg.Add(R"svg(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="18" fill="{}"/>)svg", x,
              y + 2, width, ColourOf(outcome));
      if (width > kLeastLabelled) {
        svg.Add(R"svg(<text x="{:.1f}" y="{:.1f}" class="m" style="fill:{}">{}</text>)svg",
                x + width / 2, y + 15, outcome == Outcome::kUndecided ? "#333" : "white", count);
      }
      x += width;
    }
    for (const BridgeRun& run : series.runs) {
      svg.Add(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="4" fill="{}" opacity="0.5"/>)svg",
              kDotsLeft + run.final_share * kDots, y + 11, ColourOf(run.outcome));
    }
    y += kRow;
  }
  return svg.Take();
}

std::string DrawChoices(const BridgeSeries& series) {
  constexpr size_t kBins = 20;
  std::array<int, kBins> all{};
  std::array<int, kBins> took_short{};
  for (const BridgeRun& run : series.runs) {
    for (const Choice& choice : run.choices) {
      const size_t bin = std::min(kBins - 1, static_cast<size_t>(choice.short_trail * kBins));
      ++all[bin];
      took_short[bin] += choice.branch == Branch::kShort ? 1 : 0;
    }
  }
  chart::Svg svg(460, 430, "What a robot chooses: " + series.experiment.name);
  const Plot plot{60, 60, 360, 310, 1};
  DrawFrame(&svg, plot);
  svg.Text(12, 44, "t", "choices of the short branch; the dots' area is the number of choices");
  for (const double share : {0.0, 0.5, 1.0}) {
    svg.Text(plot.X(share), plot.Y(0) + 16, "t m", fmt::format("{:.0f} %", share * 100));
  }
  svg.Text(plot.X(0.5), plot.Y(0) + 34, "t m", "share of the trail at the short branch's entry");
  std::vector<std::pair<double, double>> curve;
  for (int i = 0; i <= 100; ++i) {
    const double share = i / 100.0;
    curve.emplace_back(share, share * share / (share * share + (1 - share) * (1 - share)));
  }
  svg.Add(R"svg(<polyline points="{}" fill="none" stroke="#777" stroke-dasharray="6 4"/>)svg",
          Points(plot, curve));
  svg.Text(plot.X(0.02), plot.Y(0.9), "t", "A² / (A² + B²): Deneubourg et al. 1990");
  int most = 1;
  for (const int count : all) {
    most = std::max(most, count);
  }
  for (size_t bin = 0; bin < kBins; ++bin) {
    if (all[bin] > 0) {
      svg.Add(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="{}" opacity="0.7"/>)svg",
              plot.X((static_cast<double>(bin) + 0.5) / kBins),
              plot.Y(static_cast<double>(took_short[bin]) / all[bin]),
              2 + 12 * std::sqrt(static_cast<double>(all[bin]) / most), kShortColour);
    }
  }
  return svg.Take();
}

std::string DrawTrails(const std::vector<BridgeMoment>& moments) {
  constexpr double kScale = 70;  // pixels a metre
  constexpr size_t kColumns = 2;
  constexpr double kWidth = 7 * kScale;
  constexpr double kHeight = 4.5 * kScale;
  const size_t rows = (moments.size() + kColumns - 1) / kColumns;
  chart::Svg svg(kColumns * kWidth, 60 + static_cast<double>(rows) * kHeight,
                 "The double bridge and its trails");
  svg.Text(12, 44, "t",
           "Squares: nodes with pheromone, the fuller the stronger. Triangles: robots.");
  for (size_t i = 0; i < moments.size(); ++i) {
    const size_t row = i / kColumns;
    DrawMoment(&svg, moments[i], static_cast<double>(i % kColumns) * kWidth,
               64 + static_cast<double>(row) * kHeight, kScale);
  }
  return svg.Take();
}

}  // namespace pheromone::swarm
