// What an operator's requests, the largest that the interface permits, do to the robots beside.
//
// For each: robots that ask fifty times a second (steady_robots.h) first alone, then beside the
// request, which is made again and again for as long; two maps, one of 10^7 nodes and one that is
// filled to its limit of memory; with a journal. What the server refuses is said, and so is what it
// does not finish: then it is killed, and the next request meets a new one.
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
