// Transitions that may be fired as soon as they are enabled, without another order being tried.
//
// Such a transition commutes with all others: it cannot be disabled, and disables none. So {t} is a
// persistent set (Godefroid 1996; a stubborn set of one, Valmari 1989) wherever t is enabled, and a
// search that fires t alone there finds all deadlocks. If t also changes no place and is no
// transition that a claim names, and if such transitions cannot fire for ever among themselves, the
// search decides the claim as the full one does (stuttering equivalence; Peled 1993).
#pragma once

#include <cstdint>
#include <vector>

#include "server/core/petri/net.h"

namespace pheromone::petri {

/// Those that commute with all others, cannot go round in a circle, change no place of
/// `visible_places` and are not in `visible_transitions`. By rising number.
std::vector<uint32_t> EagerTransitions(const Net& net, const std::vector<uint32_t>& visible_places,
                                       const std::vector<uint32_t>& visible_transitions);

}  // namespace pheromone::petri
