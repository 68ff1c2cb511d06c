#include "server/chart/panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "server/chart/svg.h"

namespace pheromone::chart {
namespace {

constexpr double kLeft = 52;  // from a panel's corner to its axes, if the ticks' texts are short
constexpr double kTop = 30;
constexpr double kRight = 16;
constexpr double kBottom = 42;
constexpr double kTitleHeight = 36;
constexpr double kLegendLine = 20;
constexpr double kLegendGap = 10;     // below the legend
constexpr double kLetter = 6.6;       // of a text of 12 pixels, on average
constexpr double kTitleLetter = 9.8;  // of 16 pixels, bold
constexpr double kTickLetter = 6.2;   // of 11 pixels
constexpr double kYLabelWidth = 20;

// Okabe and Ito's colours, which people with any colour vision can tell apart; and a mark for each,
// as a path around (0, 0).
struct Look {
  const char* colour;
  const char* mark;
};
constexpr Look kLooks[] = {
    {"#d55e00", "M-5 0A5 5 0 1 0 5 0A5 5 0 1 0 -5 0Z"},
    {"#0072b2", "M-4.5 -4.5H4.5V4.5H-4.5Z"},
    {"#009e73", "M0 -6L6 0L0 6L-6 0Z"},
    {"#56b4e9", "M0 -6L5.5 4.5H-5.5Z"},
    {"#cc79a7", "M0 6L5.5 -4.5H-5.5Z"},
    {"#333333", "M-5 -2H5V2H-5Z"},
};

// What a label stands for, in all panels.
struct Entry {
  std::string colour;
  const char* mark;
  bool line;
};

class Legend {
 public:
  explicit Legend(const std::vector<Panel>& panels) {
    for (const Panel& panel : panels) {
      for (const Series& series : panel.series) {
        Add(series);
      }
    }
  }

  const Entry& operator[](const Series& series) const { return entries_.at(series.label); }

  /// Lines of `width` pixels that it takes.
  int lines(double width) const {
    return Place(width, [](double, int, const std::string&) {});
  }

  void Draw(double width, Svg* svg) const {
    Place(width, [&](double x, int line, const std::string& label) {
      const Entry& entry = entries_.at(label);
      const double y = kTitleHeight + 10 + kLegendLine * line;
      if (entry.line) {
        svg->Add(R"svg(<path d="M{:.1f} {:.1f}h22" stroke="{}" stroke-width="1.6"/>)svg", x - 11, y,
                 Escaped(entry.colour));
      }
      svg->Add(R"svg(<path transform="translate({:.1f} {:.1f})" d="{}" fill="{}"/>)svg", x, y,
               entry.mark, Escaped(entry.colour));
      svg->Text(x + 15, y + 4, "", label);
    });
  }

 private:
  void Add(const Series& series) {
    const Look& look = kLooks[labels_.size() % std::size(kLooks)];
    const std::string colour = series.colour.empty() ? look.colour : series.colour;
    if (entries_.insert({series.label, {colour, look.mark, false}}).second) {
      labels_.push_back(series.label);
    }
    entries_.at(series.label).line |= series.style == Series::Style::kLine;
  }

  // Calls put(x of the mark, line, label) for each label and returns the number of lines.
  int Place(double width, const auto& put) const {
    constexpr double kFirst = 23;
    double x = kFirst;
    int line = 0;
    for (const std::string& label : labels_) {
      const double needed = 22 + kLetter * static_cast<double>(label.size());
      if (x > kFirst && x + needed > width) {
        x = kFirst;
        ++line;
      }
      put(x, line, label);
      x += needed + 24;
    }
    return line + 1;
  }

  std::vector<std::string> labels_;  // in the order of their first series
  std::map<std::string, Entry> entries_;
};

class PanelDrawing {
 public:
  PanelDrawing(const Panel& panel, const Legend& legend, const Layout& layout, double left,
               double top, Svg* svg)
      : panel_(panel),
        legend_(legend),
        left_(left),
        top_(top + kTop),
        right_(left + layout.panel_width - kRight),
        bottom_(top + layout.panel_height - kBottom),
        line_mark_(std::min(1.0, layout.panel_width / 500)),
        svg_(svg) {
    SetAxes();
    size_t longest = 0;
    for (const double y : y_.ticks) {
      longest = std::max(longest, YTick(y).size());
    }
    plot_left_ = left + std::max(kLeft, kYLabelWidth + kTickLetter * static_cast<double>(longest));
  }

  void Draw() {
    DrawAxes();
    for (const Series& series : panel_.series) {
      DrawSeries(series);
    }
  }

 private:
  bool HasPlaces(const Mark& mark) const {
    return HasPlace(panel_.x_scale, mark.x) && HasPlace(panel_.y_scale, mark.y);
  }

  static bool HasWhisker(const Mark& mark) {
    return mark.low != mark.high && std::isfinite(mark.low) && std::isfinite(mark.high);
  }

  void SetAxes() {
    double x_least = INFINITY;
    double x_most = -INFINITY;
    double y_least = panel_.y_scale == Scale::kLinear ? 0 : INFINITY;
    double y_most = -INFINITY;
    for (const Series& series : panel_.series) {
      for (const Mark& mark : series.marks) {
        if (!HasPlaces(mark)) {
          continue;
        }
        x_least = std::min(x_least, mark.x);
        x_most = std::max(x_most, mark.x);
        y_least = std::min(y_least, mark.y);
        y_most = std::max(y_most, mark.y);
        for (const double end : {mark.low, mark.high}) {
          if (HasWhisker(mark) && HasPlace(panel_.y_scale, end)) {
            y_least = std::min(y_least, end);
            y_most = std::max(y_most, end);
          }
        }
      }
    }
    if (x_least > x_most) {  // no marks
      x_least = panel_.x_scale == Scale::kLinear ? 0 : 1;
      y_least = panel_.y_scale == Scale::kLinear ? 0 : 1;
      x_most = y_most = 1;
    }
    if (panel_.y_most > 0) {
      y_most = panel_.y_most;
    }
    x_ = panel_.categories.empty() ? AxisOver(panel_.x_scale, x_least, x_most)
                                   : CategoryAxis(static_cast<int>(panel_.categories.size()));
    y_ = AxisOver(panel_.y_scale, std::min(y_least, y_most), y_most);
  }

  double X(double x) const { return std::lerp(plot_left_, right_, x_.ShareOf(x)); }
  double Y(double y) const { return std::lerp(bottom_, top_, y_.ShareOf(y)); }

  std::string YTick(double y) const { return panel_.y_tick ? panel_.y_tick(y) : Number(y); }
  std::string XTick(size_t i) const {
    return panel_.categories.empty() ? Number(x_.ticks[i]) : panel_.categories[i];
  }
  static std::string Number(double value) { return fmt::format("{:g}", value); }

  void DrawAxes() {
    svg_->Text(plot_left_, top_ - 14, "b", panel_.title);
    for (const double y : y_.ticks) {
      svg_->Add(R"svg(<path d="M{:.1f} {:.1f}H{:.1f}" stroke="#dddddd"/>)svg", plot_left_, Y(y),
                right_);
      svg_->Text(plot_left_ - 5, Y(y) + 4, "t e", YTick(y));
    }
    for (size_t i = 0; i < x_.ticks.size(); ++i) {
      const double x = X(x_.ticks[i]);
      if (panel_.categories.empty()) {
        svg_->Add(R"svg(<path d="M{:.1f} {:.1f}v4" stroke="#888888"/>)svg", x, bottom_);
      }
      svg_->Text(x, bottom_ + 15, "t m", XTick(i));
    }
    svg_->Add(R"svg(<path d="M{:.1f} {:.1f}V{:.1f}H{:.1f}" fill="none" stroke="#888888"/>)svg",
              plot_left_, top_, bottom_, right_);
    svg_->Text((plot_left_ + right_) / 2, bottom_ + 31, "m", panel_.x_label);
    svg_->Add(R"svg(<text transform="translate({:.1f} {:.1f}) rotate(-90)" class="m">{}</text>)svg",
              left_ + 13, (top_ + bottom_) / 2, Escaped(panel_.y_label));
  }

  void DrawSeries(const Series& series) {
    const std::string colour = Escaped(legend_[series].colour);
    if (series.style == Series::Style::kLine) {
      std::string points;
      for (const Mark& mark : series.marks) {
        if (HasPlaces(mark)) {
          points += fmt::format("{:.1f},{:.1f} ", X(mark.x), Y(mark.y));
        }
      }
      svg_->Add(R"svg(<polyline points="{}" fill="none" stroke="{}" stroke-width="1.6"/>)svg",
                points, colour);
    }
    for (const Mark& mark : series.marks) {
      if (HasPlaces(mark)) {
        DrawMark(series, mark, colour);
      }
    }
  }

  void DrawMark(const Series& series, const Mark& mark, const std::string& colour) {
    const double x = X(mark.x);
    if (HasWhisker(mark)) {
      svg_->Add(
          R"svg(<path d="M{:.1f} {:.1f}V{:.1f}" stroke="{}" stroke-width="1.2" opacity="0.6"/>)svg",
          x, Y(mark.low), Y(mark.high), colour);
    }
    const bool cloud = series.style == Series::Style::kCloud;
    const double size = cloud ? 0.35 : series.style == Series::Style::kLine ? line_mark_ : 0.85;
    if (mark.y <= y_.to) {
      svg_->Add(
          R"svg(<path transform="translate({:.1f} {:.1f}) scale({})" d="{}" fill="{}"{}/>)svg", x,
          Y(mark.y), size, legend_[series].mark, colour, cloud ? " opacity=\"0.45\"" : "");
    } else if (!cloud) {
      svg_->Add(
          R"svg(<path d="M{:.1f} {:.1f}l-4 7h8Z" fill="white" stroke="{}" stroke-width="1.4"/>)svg",
          x, top_, colour);
    }
  }

  const Panel& panel_;
  const Legend& legend_;
  double left_;  // the panel's; the others are the axes'
  double top_;
  double right_;
  double bottom_;
  double line_mark_;  // the size of marks on a line: full in a large panel
  double plot_left_ = 0;
  Svg* svg_;
  Axis x_;
  Axis y_;
};

}  // namespace

std::string DrawPanels(const std::string& title, const std::vector<Panel>& panels,
                       const Layout& layout) {
  const auto across = static_cast<size_t>(std::max(1, layout.columns));
  const size_t rows = (panels.size() + across - 1) / across;
  const auto in_a_row = static_cast<double>(std::clamp<size_t>(panels.size(), 1, across));
  const double width =
      std::max(layout.panel_width * in_a_row, kTitleLetter * static_cast<double>(title.size())) +
      12;
  const Legend legend(panels);
  const double head = kTitleHeight + kLegendLine * legend.lines(width) + kLegendGap;
  Svg svg(width, head + layout.panel_height * static_cast<double>(rows) + 8, title);
  legend.Draw(width, &svg);
  for (size_t i = 0; i < panels.size(); ++i) {
    PanelDrawing(panels[i], legend, layout, layout.panel_width * static_cast<double>(i % across),
                 head + layout.panel_height * static_cast<double>(i / across), &svg)
        .Draw();
  }
  return svg.Take();
}

}  // namespace pheromone::chart
