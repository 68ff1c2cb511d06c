// What a net's flows say of claims, without a look at its markings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/core/petri/flows.h"
#include "server/core/petri/net.h"
#include "server/core/petri/property.h"

namespace pheromone::petri {

/// "busy + 2 * free = 1": what the flow says of the initial marking's descendants.
std::string TextOf(const Net& net, const Flow& flow);

/// Comparisons that all hold if and only if the expression does, or does not with `negated`;
/// nothing if it is not of that kind.
std::optional<std::vector<Comparison>> AsConjunction(const Expression& expression, bool negated);

/// Why the comparison holds in each reachable marking; nothing if the flows do not show it.
std::optional<std::string> WhyAlways(const Net& net, const Comparison& comparison,
                                     const std::vector<Flow>& semiflows);

}  // namespace pheromone::petri
