// A net in Promela, for the model checker Spin.
//
//   const Result<std::string> model = ToPromela(net, {.bound = 1, .assertion = "p0 + p1 <= 1"});
//   // spin -a net.pml && cc -DSAFETY -o pan pan.c && ./pan
//
// One process fires one transition at a time, so that the states that Spin stores are the reachable
// markings, no more and no fewer. An invalid end state is a deadlock; with `./pan -E` Spin does not
// look for any. Place number 3 is the variable p3. Any thread.
#pragma once

#include <cstdint>
#include <string>

#include "server/base/result.h"
#include "server/core/petri/net.h"

namespace pheromone::nets {

struct PromelaOptions {
  /// Tokens that a place may have: as many as fit into a byte by default. More are an assertion
  /// violated.
  uint32_t bound = 255;
  /// An expression of Promela that is to hold in each marking, such as "p0 + p1 <= 1".
  std::string assertion{};
};

/// An error if the initial marking has more tokens than the bound.
Result<std::string> ToPromela(const petri::Net& net, const PromelaOptions& options);

}  // namespace pheromone::nets
