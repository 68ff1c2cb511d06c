// The curves of the comparison of steering laws: two for tuning, four that no law was tuned on.
//
//   const field::Path path = PathOf(Curve::kSpiral);   // on the map of the path experiment
//
// All lie on the map of 10 m x 10 m of path_experiment.h, on its pheromone type, and are longer
// than a robot at 300 mm/s goes in 20 s. Curves that are not polygons by nature have sides of 25
// mm.
#pragma once

#include <string_view>
#include <vector>

#include "server/core/field/path.h"

namespace pheromone::swarm {

enum class Curve {
  kLine,    ///< for tuning: oblique, 8.9 m
  kCircle,  ///< for tuning: radius 1.5 m
  kSCurve,  ///< two quarter arcs of radius 1 m, left then right, and a straight way out
  kSpiral,  ///< of Archimedes, inwards: radius 2.6 m to 0.6 m in 1.2 turns
  kEight,   ///< lemniscate of Bernoulli, 4.8 m wide: least radius 0.8 m, crosses itself
  kSquare,  ///< side 3 m, corners of radius 0.4 m
};

/// What laws are tuned on, and what they are compared on.
const std::vector<Curve>& TuningCurves();
const std::vector<Curve>& UnseenCurves();

std::string_view NameOf(Curve curve);

field::Path PathOf(Curve curve);

}  // namespace pheromone::swarm
