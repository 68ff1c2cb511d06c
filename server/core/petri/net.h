// Place/transition nets with weights, read arcs and inhibitor arcs.
//
//   Net net{.name = "mutex",
//           .places = {{.id = "free", .tokens = 1}, {.id = "idle", .tokens = 2}, {.id = "busy"}},
//           .transitions = {{.id = "enter", .takes = {{0}, {1}}, .gives = {{2}}}}};
//   Marking marking = InitialMarking(net);
//   if (IsEnabled(net, 0, marking)) marking = Fire(net, 0, marking);
//
// A marking has a number of tokens for each place. Places and transitions are numbered from 0 in
// the order of the net. Plain values; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "server/base/result.h"
#include "server/core/petri/net_data.h"

namespace pheromone::petri {

/// Tokens by place.
using Marking = Eigen::Matrix<int32_t, Eigen::Dynamic, 1>;
/// Transitions x places: A of Ferreira et al. 2018, eq. (1).
using IncidenceMatrix = Eigen::Matrix<int32_t, Eigen::Dynamic, Eigen::Dynamic>;

/// What is wrong with the net: empty or repeated IDs, arcs to places that do not exist or named
/// twice in a list, weights of 0, tokens or weights above kMaxTokens.
Status CheckNet(const Net& net);

/// The place or transition of that ID; the number of them if there is none.
size_t PlaceOf(const Net& net, std::string_view id);
size_t TransitionOf(const Net& net, std::string_view id);

Marking InitialMarking(const Net& net);

/// What a transition gives less what it takes. Read and inhibitor arcs are not in it, nor is what a
/// transition both takes and gives.
IncidenceMatrix IncidenceOf(const Net& net);

bool IsEnabled(const Net& net, size_t transition, const Marking& marking);

/// The marking after an enabled transition has fired; eq. (1) for a single transition.
Marking Fire(const Net& net, size_t transition, const Marking& marking);

}  // namespace pheromone::petri
