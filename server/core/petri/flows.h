// What stays the same whatever fires: P-invariants, and semiflows, those without negative weights.
//
//   const FlowBasis basis = PlaceInvariants(net);          // y with A y = 0
//   const Semiflows all = PlaceSemiflows(net);             // the minimal ones
//   all.flows[0].terms;                                    // free + busy = 1: {{0, 1}, {2, 1}}
//   const std::vector<uint64_t> bounds = BoundsBy(net, all.flows);
//
// All arithmetic is exact: in 64 bits, and given up where they do not suffice. Read and inhibitor
// arcs play no role: what holds without them holds with them.
//
// Colom, Silva: Convex geometry and semiflows in P/T nets, 1991; the algorithm is Farkas's.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "server/core/petri/net.h"

namespace pheromone::petri {

struct FlowTerm {
  uint32_t index;  ///< of a place, or of a transition
  int64_t weight;

  bool operator==(const FlowTerm&) const = default;
};

/// Weights by rising index, none of them 0, without a common divisor.
struct Flow {
  std::vector<FlowTerm> terms;

  bool operator==(const Flow&) const = default;
};

struct FlowBasis {
  std::vector<Flow> flows;
  bool complete = true;  ///< false: given up, because numbers grew beyond 64 bits
};

/// Linearly independent P-invariants from which all others come: places less the rank of the
/// incidence matrix.
FlowBasis PlaceInvariants(const Net& net);

struct Semiflows {
  std::vector<Flow> flows;  ///< of minimal support
  bool complete = true;     ///< false: given up: too many, or numbers grew beyond 64 bits
};

Semiflows PlaceSemiflows(const Net& net);

/// Firings that lead back to the same marking.
Semiflows TransitionSemiflows(const Net& net);

/// Weights times initial tokens: what the flow's sum of tokens is in each reachable marking.
/// Saturates.
int64_t ValueOf(const Net& net, const Flow& flow);

inline constexpr uint64_t kNoBound = std::numeric_limits<uint64_t>::max();

/// How many tokens each place has at most in any reachable marking, by the semiflows that name it;
/// kNoBound: by none.
std::vector<uint64_t> BoundsBy(const Net& net, const std::vector<Flow>& semiflows);

}  // namespace pheromone::petri
