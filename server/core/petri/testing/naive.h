// All reachable markings and what is true of them, in the plainest way: for comparison.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "server/core/petri/net.h"

namespace pheromone::petri {

struct NaiveGraph {
  struct Edge {
    size_t to;
    size_t transition;
  };

  std::vector<Marking> markings;  ///< breadth first
  std::vector<size_t> depth;
  std::vector<std::vector<Edge>> edges;
  bool complete = true;

  NaiveGraph(const Net& net, size_t max_states) {
    const auto less = [](const Marking& a, const Marking& b) {
      return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    };
    std::map<Marking, size_t, decltype(less)> numbers(less);
    markings = {InitialMarking(net)};
    depth = {0};
    numbers[markings[0]] = 0;
    for (size_t from = 0; from < markings.size(); ++from) {
      edges.emplace_back();
      for (size_t t = 0; t < net.transitions.size(); ++t) {
        if (!IsEnabled(net, t, markings[from])) {
          continue;
        }
        const Marking next = Fire(net, t, markings[from]);
        const auto [found, is_new] = numbers.try_emplace(next, markings.size());
        if (is_new) {
          markings.push_back(next);
          depth.push_back(depth[from] + 1);
        }
        edges[from].push_back({found->second, t});
      }
      if (markings.size() > max_states) {
        complete = false;
        return;
      }
    }
  }

  size_t edge_count() const {
    size_t count = 0;
    for (const auto& some : edges) {
      count += some.size();
    }
    return count;
  }

  /// The depth of the first marking for which `test` holds.
  template <typename Test>
  std::optional<size_t> DepthOf(const Test& test) const {
    for (size_t state = 0; state < markings.size(); ++state) {
      if (test(state)) {
        return depth[state];
      }
    }
    return std::nullopt;
  }

  /// Whether from each marking one can be reached for which `test` holds.
  template <typename Test>
  bool AlwaysAgain(const Test& test) const {
    std::vector<bool> can(markings.size());
    bool changed = true;
    while (changed) {
      changed = false;
      for (size_t state = 0; state < markings.size(); ++state) {
        const bool now = can[state] || test(state) ||
                         std::any_of(edges[state].begin(), edges[state].end(),
                                     [&](const Edge& edge) { return can[edge.to]; });
        changed = changed || now != can[state];
        can[state] = now;
      }
    }
    return std::all_of(can.begin(), can.end(), [](bool it) { return it; });
  }
};

}  // namespace pheromone::petri
