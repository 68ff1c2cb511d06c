// What was measured: for each case, the time of one operation in each repetition.
//
//   Results results;
//   results.Add(key, ns);
//   const Summary* field = results.Find({.group = "query", .variant = "field", ...});
//
// Not thread-safe.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/core/field/bench/workload.h"

namespace pheromone::field::bench {

/// What a case measures. Cases that differ in `variant` alone answer the same question.
struct CaseKey {
  std::string group;    ///< "query", "robot-step", "option", ...
  std::string variant;  ///< "field", "literal scan", ...
  MapSpec map;
  int reach = 0;   ///< cells
  int robots = 0;  ///< 0: each query from another random place

  /// "query/field/N=1000/r=10/d=10%": unique, and how --benchmark_filter finds it.
  std::string name() const;
};

/// Nanoseconds of one operation, over the repetitions.
struct Summary {
  double median = 0;
  double p10 = 0;
  double p90 = 0;
};
/// Of at least one value; quantiles between two of them are interpolated.
Summary Summarise(std::vector<double> values);

struct Result {
  CaseKey key;
  Summary ns;
  size_t repetitions = 0;
};

class Results {
 public:
  void Add(const CaseKey& key, double ns);

  /// Empty if the case did not run.
  std::optional<Summary> Find(const CaseKey& key) const;

  /// In the order in which they first ran.
  std::vector<Result> All() const;

 private:
  struct Entry {
    CaseKey key;
    std::vector<double> ns;
  };
  std::vector<Entry> entries_;
  std::map<std::string, size_t> index_;  // by name
};

}  // namespace pheromone::field::bench
