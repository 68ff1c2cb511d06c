// What was measured, for people and for other programs.
#pragma once

#include <string>

#include "server/core/field/bench/results.h"

namespace pheromone::field::bench {

/// "412 ns", "7.35 ms": three digits and a unit.
std::string Duration(double ns);

/// One table a group: the median, the spread from the tenth to the ninetieth percentile of the
/// repetitions, and how many times the field's time each baseline takes in the same case.
std::string Tables(const Results& results);

/// One line a case, with a heading: names, numbers of the case, times in ns.
std::string Csv(const Results& results);

}  // namespace pheromone::field::bench
