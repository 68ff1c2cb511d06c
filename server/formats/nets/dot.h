// Pictures of a net and of what happens in it, as text for Graphviz.
//
//   Status written = WriteFile("net.dot", DotOfNet(net));  // dot -Tsvg net.dot -o net.svg
//
// Any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/core/petri/net.h"

namespace pheromone::nets {

/// Places are circles with their initial tokens, pseudo-boxes have a double line, transitions are
/// bars, and what has the same owner is framed. Names, or else IDs, are inside. Arcs that take or
/// give have an arrow, read arcs are dashed lines without one, and inhibitor arcs end in a small
/// circle. A double arrow takes and gives back.
std::string DotOfNet(const petri::Net& net);

/// A sequence of firings, such as a counter-example, as a table of IDs: a row for each transition
/// fired, a column for each place that changes, and in it the tokens afterwards, coloured if they
/// are more or fewer than before. Tokens elsewhere are listed below. Each transition is enabled
/// when its turn comes.
std::string DotOfTrace(const petri::Net& net, const std::vector<uint32_t>& transitions);

}  // namespace pheromone::nets
