#include "client_fw/swarm/small_multiples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace pheromone::swarm {
namespace {

constexpr double kPanelWidth = 300;
constexpr double kPanelHeight = 220;
constexpr double kLeft = 52;  // from a panel's corner to its axes
constexpr double kTop = 30;
constexpr double kRight = 16;
constexpr double kBottom = 42;
constexpr double kTitleHeight = 36;
constexpr double kLegendHeight = 30;

struct Axis {
  double from = 0;
  double to = 1;
  double step = 1;
};

// Round steps of 1, 2 or 5 times a power of ten, three to six of them.
Axis AxisOver(double least, double most) {
  const double span = most > least ? most - least : std::max(std::abs(most), 1.0);
  const double power = std::pow(10, std::floor(std::log10(span / 4)));
  double step = 10 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (span / (factor * power) <= 6) {
      step = factor * power;
      break;
    }
  }
  return {std::floor(least / step + 1e-9) * step, std::ceil(most / step - 1e-9) * step, step};
}

int TicksOf(const Axis& axis) {
  return static_cast<int>(std::lround((axis.to - axis.from) / axis.step));
}

std::string Escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    safe += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  }
  return safe;
}

class PanelDrawing {
 public:
  PanelDrawing(const Panel& panel, double left, double top, std::string* svg)
      : panel_(panel), left_(left), top_(top), svg_(svg) {
    double x_least = 1e300;
    double x_most = -1e300;
    double y_least = 1e300;
    double y_most = -1e300;
    for (const Series& series : panel.series) {
      for (const Mark& mark : series.marks) {
        x_least = std::min(x_least, mark.x);
        x_most = std::max(x_most, mark.x);
        y_least = std::min({y_least, mark.y, mark.low == mark.high ? mark.y : mark.low});
        y_most = std::max({y_most, mark.y, mark.low == mark.high ? mark.y : mark.high});
      }
    }
    if (x_least > x_most) {  // no marks
      x_least = y_least = 0;
      x_most = y_most = 1;
    }
    x_ = AxisOver(x_least, x_most);
    if (!panel.categories.empty()) {
      x_ = {-0.5, static_cast<double>(panel.categories.size()) - 0.5, 1};
    }
    y_ = AxisOver(std::min(0.0, y_least), panel.y_most > 0 ? panel.y_most : y_most);
  }

  void Draw() {
    DrawAxes();
    for (const Series& series : panel_.series) {
      DrawSeries(series);
    }
  }

 private:
  template <typename... Args>
  void Add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(*svg_), format, std::forward<Args>(args)...);
    *svg_ += '\n';
  }

  double X(double x) const {
    return left_ + kLeft + (x - x_.from) / (x_.to - x_.from) * (kPanelWidth - kLeft - kRight);
  }
  double Y(double y) const {
    return top_ + kPanelHeight - kBottom -
           (std::min(y, y_.to) - y_.from) / (y_.to - y_.from) * (kPanelHeight - kTop - kBottom);
  }

  void DrawAxes() {
    Add(R"svg(<text x="{:.1f}" y="{:.1f}" font-size="13" font-weight="bold">{}</text>)svg",
        left_ + kLeft, top_ + 16, Escaped(panel_.title));
    for (int i = 0; i <= TicksOf(y_); ++i) {
      const double y = y_.from + i * y_.step;
      Add(R"svg(<path d="M{0:.1f} {1:.1f}H{2:.1f}" stroke="#dddddd"/><text x="{3:.1f}" y="{4:.1f}" class="t" text-anchor="end">{5:g}</text>)svg",
          X(x_.from), Y(y), X(x_.to), X(x_.from) - 5, Y(y) + 4, std::round(y * 1e6) / 1e6);
    }
    const double base = Y(y_.from);
    if (panel_.categories.empty()) {
      for (int i = 0; i <= TicksOf(x_); ++i) {
        const double x = x_.from + i * x_.step;
        Add(R"svg(<path d="M{0:.1f} {1:.1f}v4" stroke="#888888"/><text x="{0:.1f}" y="{2:.1f}" class="t" text-anchor="middle">{3:g}</text>)svg",
            X(x), base, base + 15, std::round(x * 1e6) / 1e6);
      }
    }
    for (size_t i = 0; i < panel_.categories.size(); ++i) {
      Add(R"svg(<text x="{:.1f}" y="{:.1f}" class="t" text-anchor="middle">{}</text>)svg",
          X(static_cast<double>(i)), base + 15, Escaped(panel_.categories[i]));
    }
    Add(R"svg(<path d="M{0:.1f} {1:.1f}V{2:.1f}H{3:.1f}" fill="none" stroke="#888888"/>)svg",
        X(x_.from), Y(y_.to), base, X(x_.to));
    Add(R"svg(<text x="{:.1f}" y="{:.1f}" class="l" text-anchor="middle">{}</text>)svg",
        (X(x_.from) + X(x_.to)) / 2, base + 31, Escaped(panel_.x_label));
    const double middle = (Y(y_.from) + Y(y_.to)) / 2;
    Add(R"svg(<text transform="translate({:.1f} {:.1f}) rotate(-90)" class="l" text-anchor="middle">{}</text>)svg",
        left_ + 13, middle, Escaped(panel_.y_label));
  }

  void DrawSeries(const Series& series) {
    if (series.style == Series::Style::kLine) {
      std::string points;
      for (const Mark& mark : series.marks) {
        points += fmt::format("{:.1f},{:.1f} ", X(mark.x), Y(mark.y));
      }
      Add(R"svg(<polyline points="{}" fill="none" stroke="{}" stroke-width="1.6"/>)svg", points,
          series.colour);
    }
    for (const Mark& mark : series.marks) {
      DrawMark(series, mark);
    }
  }

  void DrawMark(const Series& series, const Mark& mark) {
    if (mark.low != mark.high) {
      Add(R"svg(<path d="M{:.1f} {:.1f}V{:.1f}" stroke="{}" stroke-width="1.2" opacity="0.6"/>)svg",
          X(mark.x), Y(mark.low), Y(mark.high), series.colour);
    }
    const bool cloud = series.style == Series::Style::kCloud;
    const double radius = cloud ? 1.6 : series.style == Series::Style::kLine ? 2.4 : 4;
    if (mark.y <= y_.to) {
      Add(R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="{}"{}/>)svg", X(mark.x), Y(mark.y),
          radius, series.colour, cloud ? " opacity=\"0.45\"" : "");
    } else if (!cloud) {
      Add(R"svg(<path d="M{:.1f} {:.1f}l-4 7h8Z" fill="white" stroke="{}" stroke-width="1.4"/>)svg",
          X(mark.x), Y(y_.to), series.colour);
    }
  }

  const Panel& panel_;
  double left_;
  double top_;
  std::string* svg_;
  Axis x_;
  Axis y_;
};

std::vector<const Series*> LegendOf(const std::vector<Panel>& panels) {
  std::vector<const Series*> entries;
  for (const Panel& panel : panels) {
    for (const Series& series : panel.series) {
      const bool known = std::any_of(entries.begin(), entries.end(), [&](const Series* entry) {
        return entry->label == series.label;
      });
      if (!known) {
        entries.push_back(&series);
      }
    }
  }
  return entries;
}

}  // namespace

std::string DrawPanels(const std::string& title, const std::vector<Panel>& panels, int columns) {
  const auto across = static_cast<size_t>(std::max(1, columns));
  const size_t rows = (panels.size() + across - 1) / across;
  const double width = kPanelWidth * static_cast<double>(std::min(across, panels.size())) + 12;
  const double height = kTitleHeight + kLegendHeight + kPanelHeight * static_cast<double>(rows) + 8;
  std::string svg = fmt::format(
      R"svg(<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}">
<style>text{{font-family:sans-serif;fill:#333}}.t{{font-size:10px;fill:#666}}.l{{font-size:11px}}</style>
<rect width="100%" height="100%" fill="white"/>
<text x="14" y="24" font-size="16" font-weight="bold">{2}</text>
)svg",
      width, height, Escaped(title));
  double x = 18;
  for (const Series* entry : LegendOf(panels)) {
    svg += fmt::format(
        R"svg(<circle cx="{:.1f}" cy="{:.1f}" r="4.5" fill="{}"/><text x="{:.1f}" y="{:.1f}" font-size="12">{}</text>)svg",
        x, kTitleHeight + 10, entry->colour, x + 9, kTitleHeight + 14, Escaped(entry->label));
    svg += '\n';
    x += 34 + 6.6 * static_cast<double>(entry->label.size());
  }
  for (size_t i = 0; i < panels.size(); ++i) {
    const size_t row = i / across;
    PanelDrawing(panels[i], kPanelWidth * static_cast<double>(i % across),
                 kTitleHeight + kLegendHeight + kPanelHeight * static_cast<double>(row), &svg)
        .Draw();
  }
  return svg + "</svg>\n";
}

}  // namespace pheromone::swarm
