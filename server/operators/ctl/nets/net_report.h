// What was found out about a net, as text for people and as JSON for scripts.
#pragma once

#include <string>

#include "server/core/petri/check.h"
#include "server/core/petri/net.h"

namespace pheromone::ctl {

/// Lines that end in "\n", of at most 100 characters where there are spaces; SummaryOf is the last.
std::string TextOfReport(const petri::Net& net, const petri::CheckReport& report, double seconds);

/// What it comes to, in a sentence: "all 24 claims proved; not safe: place nest can have 2 tokens".
/// The claims come first: the exit status follows them alone.
std::string SummaryOf(const petri::Net& net, const petri::CheckReport& report);

/// One object: summary, net, states, transitions (edges of the graph of states), deadlock, safe
/// (true, false, or null for unknown), properties, invariants, semiflows, bounds, seconds,
/// bytes_per_state, method.
std::string JsonOfReport(const petri::Net& net, const petri::CheckReport& report, double seconds);

/// What is printed under that name; null if nothing is.
const petri::Finding* FindingNamed(const petri::CheckReport& report, const std::string& name);

/// Whether all claims of the net are proved.
bool AllProved(const petri::CheckReport& report);

}  // namespace pheromone::ctl
