// Small multiples: a grid of diagrams with the same series in each, as SVG; or a single diagram.
//
//   Panel panel{.title = "period", .x_label = "ms", .y_label = "mean error, mm"};
//   panel.series = {{"fuzzy", "", {{100, 22, 20, 25}, {200, 24, 21, 28}}}};
//   const std::string svg = DrawPanels("Sweeps", {panel}, {.columns = 4});
//
// Each panel has its own axes. A linear y begins at 0, or below it if there are negative values.
// Series that share a label share one entry in the legend, and their mark: circle, square, diamond
// and so on, so that no series is known by its colour alone. The same panels give the same bytes.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/chart/axis.h"

namespace pheromone::chart {

/// One value. It is left out if an axis has no place for it (HasPlace).
struct Mark {
  double x = 0;
  double y = 0;
  double low = 0;  ///< the whisker's ends; none if they are equal
  double high = 0;
};

struct Series {
  enum class Style { kLine, kCloud, kPoint };
  std::string label;
  std::string colour;  ///< as SVG has it; empty: the n-th of Okabe and Ito's, n as in the legend
  std::vector<Mark> marks;
  Style style = Style::kLine;  ///< marks joined, faint small marks, or single large ones
};

struct Panel {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<Series> series;
  std::vector<std::string> categories;  ///< if any: x is 0, 1, ... and these are their names
  /// Where y ends; marks above lie on the edge as triangles. 0: with the highest.
  double y_most = 0;
  Scale x_scale = Scale::kLinear;
  Scale y_scale = Scale::kLinear;
  std::function<std::string(double)> y_tick;  ///< the text of a tick; empty: its number
};

struct Layout {
  int columns = 1;  ///< panels in a row, at least one
  double panel_width = 300;
  double panel_height = 220;
};

/// A complete SVG document.
std::string DrawPanels(const std::string& title, const std::vector<Panel>& panels,
                       const Layout& layout);

}  // namespace pheromone::chart
