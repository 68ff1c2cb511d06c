// The effect of an operator's largest permitted requests on the robots.
//
// For each: robots that send fifty requests a second (steady_robots.h), first alone, then during
// the operator's request, which is repeated for the same time; two maps, one of 10^7 nodes and one
// that is filled to its memory limit; with a journal. Refused and unfinished requests are reported;
// after an unfinished one, the server is killed and a new one started.
#pragma once

#include <chrono>
#include <string>

#include "proto_tests/exchange_bench/report.h"

namespace pheromone::bench {

struct OperatorOptions {
  std::string pheromoned;
  std::string folder;  ///< an empty one, on the journal's disk
  double seconds = 5;  ///< alone, and beside each request
  std::chrono::seconds patience{60};
  int field_mib = 1024;  ///< the limit of the map that is full
};

void RunOperators(const OperatorOptions& options, Report* report);

/// The process's memory, step by step, while a field is filled to its limit, written to a snapshot,
/// recorded, follows another law, and is erased.
void RunMemory(const OperatorOptions& options);

}  // namespace pheromone::bench
