// A net's semiflows by 4ti2, a package for linear spaces over integers (https://4ti2.github.io).
//
//   const FourTiTwoProject files = ToFourTiTwo(net, SemiflowsOf::kPlaces);
//   // written as net.mat, net.sign and net.rel; then `4ti2-rays net` makes net.ray
//
// A P-semiflow is a vector y >= 0 of weights of places with Ay = 0, where A is petri::IncidenceOf:
// the weighted sum of tokens is the same in all reachable markings. A T-semiflow is a vector x >= 0
// of firings with A'x = 0: after them, the marking is the one before. `rays` lists those of minimal
// support, each divided by its greatest common divisor; `qsolve` lists the same in net.qhom. Any
// thread.
#pragma once

#include <string>

#include "server/core/petri/net.h"

namespace pheromone::nets {

enum class SemiflowsOf { kPlaces, kTransitions };

struct FourTiTwoProject {
  std::string mat;   ///< a row for each equation
  std::string sign;  ///< no number of the solution is negative
  std::string rel;   ///< all are equations
};

FourTiTwoProject ToFourTiTwo(const petri::Net& net, SemiflowsOf semiflows);

}  // namespace pheromone::nets
