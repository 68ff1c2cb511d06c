// The search that tunes every law alike: half of the evaluations at random over the whole range,
// the rest increasingly close to the best so far.
//
//   const SearchResult found = Search({{2, 29}, {150, 300}}, {8, 300}, 400, /*seed=*/1, cost);
//   found.best().values;
//
// Whole numbers only, as the firmware has them. The same arguments give the same result.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pheromone::swarm {

/// The range of a value, both ends included.
struct SearchRange {
  int least = 0;
  int most = 0;
};

struct Evaluation {
  std::vector<int> values;
  double cost = 0;
};

struct SearchResult {
  std::vector<Evaluation> evaluations;  ///< in the order in which they were made
  size_t best_index = 0;                ///< the first with the least cost
  const Evaluation& best() const { return evaluations[best_index]; }
};

/// `budget` evaluations of `cost`, at least one; the first is of `start`, which lies in the ranges.
SearchResult Search(const std::vector<SearchRange>& ranges, const std::vector<int>& start,
                    int budget, uint64_t seed,
                    const std::function<double(const std::vector<int>&)>& cost);

}  // namespace pheromone::swarm
