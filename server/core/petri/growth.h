// Whether a net is unbounded: a marking that is at least as large as an earlier one on the way to
// it.
//
// What led from the earlier marking to the larger one can be fired again and again (Karp, Miller
// 1969), unless a place has grown that inhibits a transition of it: such growth is not taken for
// one. So what is found is a proof, and if nothing is found the net may be unbounded all the same.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/core/petri/net.h"

namespace pheromone::petri {

struct Growth {
  std::vector<uint32_t> way;    ///< transitions to the earlier marking
  std::vector<uint32_t> cycle;  ///< from there on, for ever
  uint32_t place = 0;           ///< grows most
};

/// Along transitions that are enabled one after the other. Of a long way only the last marking is
/// compared with the others.
std::optional<Growth> FindGrowth(const Net& net, const std::vector<uint32_t>& way);

/// On some random ways, always the same ones.
std::optional<Growth> WalkToGrowth(const Net& net);

}  // namespace pheromone::petri
