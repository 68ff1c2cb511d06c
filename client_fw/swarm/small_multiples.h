// Small multiples: a grid of little diagrams with the same series in each, as SVG.
//
//   Panel panel{.title = "period", .x_label = "ms", .y_label = "mean error, mm"};
//   panel.series = {{"fuzzy", "#1b7837", {{100, 22, 20, 25}, {200, 24, 21, 28}}}};
//   const std::string svg = DrawPanels("Sweeps", {panel}, 4);
//
// Each panel has its own axes; y begins at 0, or below it if there are negative values. Series that
// share a label share one entry in the legend. The same panels give the same bytes.
#pragma once

#include <string>
#include <vector>

namespace pheromone::swarm {

struct Mark {
  double x = 0;
  double y = 0;
  double low = 0;  ///< the whisker's ends; none if they are equal
  double high = 0;
};

struct Series {
  enum class Style { kLine, kCloud, kPoint };
  std::string label;
  std::string colour;  ///< as SVG has it
  std::vector<Mark> marks;
  Style style = Style::kLine;  ///< marks joined, faint small marks, or single large ones
};

struct Panel {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<Series> series;
  std::vector<std::string> categories;  ///< if any: x is 0, 1, ... and these are their names
  double y_most =
      0;  ///< where y ends; marks above lie on the edge as triangles. 0: with the highest
};

/// A complete SVG document; `columns` panels per row, at least one.
std::string DrawPanels(const std::string& title, const std::vector<Panel>& panels, int columns);

}  // namespace pheromone::swarm
