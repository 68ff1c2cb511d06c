// Pictures of the results, as SVG: what a robot-step costs, against one number at a time. Both axes
// are logarithmic; a bar through a mark is the spread from the tenth to the ninetieth percentile of
// its repetitions.
#pragma once

#include <string>
#include <vector>

#include "server/field/bench/results.h"

namespace pheromone::field::bench {

struct Picture {
  std::string file;  ///< "step_over_map_size.svg"
  std::string svg;
};

/// The pictures for which there are results.
std::vector<Picture> Pictures(const Results& results);

}  // namespace pheromone::field::bench
