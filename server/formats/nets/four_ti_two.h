// A net's semiflows by 4ti2, a package for linear spaces over integers (https://4ti2.github.io).
//
//   const FourTiTwoProject files = ToFourTiTwo(net, SemiflowsOf::kPlaces);
//   // written as net.mat, net.sign and net.rel; then: 4ti2-rays net
//   Result<std::vector<std::vector<int64_t>>> semiflows = ParseFourTiTwo("net.ray", bytes);
//
// A P-semiflow is a vector y >= 0 of weights of places with Ay = 0, where A is petri::IncidenceOf:
// the weighted sum of tokens is the same in all reachable markings. A T-semiflow is a vector x >= 0
// of firings with A'x = 0: after them, the marking is the one before. `rays` lists those of minimal
// support, each divided by its greatest common divisor; `qsolve` lists the same in net.qhom. Any
// thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/core/petri/net.h"

namespace pheromone::nets {

enum class SemiflowsOf { kPlaces, kTransitions };

struct FourTiTwoProject {
  std::string mat;   ///< a row for each equation
  std::string sign;  ///< no number of the solution is negative
  std::string rel;   ///< all are equations
};

FourTiTwoProject ToFourTiTwo(const petri::Net& net, SemiflowsOf semiflows);

/// The rows of a matrix as 4ti2 writes it. Errors begin with the name.
Result<std::vector<std::vector<int64_t>>> ParseFourTiTwo(std::string_view name,
                                                         std::string_view text);

}  // namespace pheromone::nets
