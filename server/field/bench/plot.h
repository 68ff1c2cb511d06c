// Pictures of the results, as SVG: what a robot-step costs, against one number at a time. Both axes
// are logarithmic; a bar through a point is the spread from the tenth to the ninetieth percentile
// of its repetitions.
#pragma once

#include <string>
#include <vector>

#include "server/field/bench/results.h"

namespace pheromone::field::bench {

struct Point {
  double x = 0;
  Summary ns;
};

struct Series {
  std::string label;
  std::vector<Point> points;  ///< in the order of x
};

struct Chart {
  std::string title;
  std::string x_label;
  std::vector<Series>
      series;  ///< at most six; the n-th has the n-th colour, empty ones are left out
};

/// A complete SVG document. At least one series has a point; all numbers are positive.
std::string DrawChart(const Chart& chart);

struct Picture {
  std::string file;  ///< "step_over_map_size.svg"
  std::string svg;
};

/// The pictures for which there are results.
std::vector<Picture> Pictures(const Results& results);

}  // namespace pheromone::field::bench
