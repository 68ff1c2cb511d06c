// Nets for tools that know nothing but places, transitions and weights, such as those that read the
// core of PNML: read and inhibitor arcs are replaced by ordinary ones.
//
//   Result<petri::Net> core = CoreNet(net, bounds);
//   std::string file = ToPnml(core.value());
//
// Any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "server/base/result.h"
#include "server/core/petri/net.h"

namespace pheromone::nets {

/// What a transition reads, it takes and gives back.
petri::Net WithoutReads(const petri::Net& net);

/// The same, and each place p with an inhibitor arc gets a complement place, which always has
/// bounds[p] - m(p) tokens: p has fewer than w tokens if and only if its complement has at least
/// bounds[p] - w + 1. New places come last, with the ID of p and "_complement".
///
/// If no reachable marking exceeds the bounds, reachable markings of the original places are those
/// of `net`; otherwise, firings that would exceed them are missing. A bound of 0 is unknown: an
/// error that names the place, as is a bound below the initial tokens.
Result<petri::Net> CoreNet(const petri::Net& net, const std::vector<uint32_t>& bounds);

}  // namespace pheromone::nets
