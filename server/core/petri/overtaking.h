// How often transitions can be fired while something holds, in a PackedGraph: the longest way
// through its components, or a circle.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/core/petri/components.h"
#include "server/core/petri/property.h"
#include "server/core/petri/state_space.h"

namespace pheromone::petri {

template <typename Graph>
class OvertakingSearch {
  using Wide = typename Graph::Wide;

 public:
  /// All are kept by reference.
  OvertakingSearch(const Graph& graph, const Property& property)
      : graph_(graph),
        property_(property),
        counts_(graph.transition_count()),
        most_(graph.size()),
        is_member_(graph.size()) {
    for (const uint32_t transition : property.transitions) {
      counts_[transition] = true;
    }
  }

  Overtaking Find(const SearchLimits& limits) {
    Overtaking found;
    found.most = 0;
    std::optional<uint32_t> best;
    Wide wide = graph_.MakeWide();
    found.complete = FindComponents(
        graph_, limits, [&](const Wide& it) { return IsInside(it); },
        [&](const std::vector<uint32_t>& members, bool) {
          for (const uint32_t member : members) {
            is_member_[member] = true;
          }
          uint32_t value = 0;
          for (const uint32_t member : members) {
            graph_.ForEachSuccessor(member, &wide, [&](uint32_t transition, uint32_t to) {
              const uint32_t once = counts_[transition] ? 1 : 0;
              if (!is_member_[to]) {
                value = std::max(value, once + MostFrom(to));
              } else if (once != 0 && found.most) {
                found.most.reset();
                found.trace = graph_.TraceTo(member);
                found.cycle = graph_.WithEager(member, Circle(member, transition, to), false);
              }
            });
          }
          for (const uint32_t member : members) {
            is_member_[member] = false;
            most_[member] = value;
            if (found.most &&
                (!best || value > *found.most || (value == *found.most && member < *best))) {
              found.most = value;
              best = member;
            }
          }
        });
    if (found.most && best && *found.most > 0) {
      found.trace = graph_.TraceTo(*best);
      const std::vector<uint32_t> rest = graph_.WithEager(*best, LongestWay(*best), false);
      found.trace.insert(found.trace.end(), rest.begin(), rest.end());
    }
    return found;
  }

 private:
  using CameFrom = std::unordered_map<uint32_t, std::pair<uint32_t, uint32_t>>;  // and transition

  bool IsInside(const Wide& wide) const {
    return Holds(property_.expression, graph_.TokensIn(wide));
  }

  // The most firings from a state on whose component is known.
  uint32_t MostFrom(uint32_t state) {
    other_.resize(graph_.MakeWide().size());
    graph_.Unpack(state, &other_);
    return IsInside(other_) ? most_[state] : 0;
  }

  // The transition between two members of a component, and a shortest way back within it.
  std::vector<uint32_t> Circle(uint32_t to, uint32_t transition_between, uint32_t from) const {
    CameFrom came;
    std::vector<uint32_t> found = {from};
    Wide wide = graph_.MakeWide();
    came[from] = {from, 0};
    for (size_t i = 0; i < found.size() && !came.contains(to); ++i) {
      graph_.ForEachSuccessor(found[i], &wide, [&](uint32_t transition, uint32_t next) {
        if (is_member_[next] && came.try_emplace(next, found[i], transition).second) {
          found.push_back(next);
        }
      });
    }
    std::vector<uint32_t> circle = WayTo(came, from, to);
    circle.insert(circle.begin(), transition_between);
    return circle;
  }

  // Back along where one came from.
  static std::vector<uint32_t> WayTo(const CameFrom& came, uint32_t from, uint32_t to) {
    std::vector<uint32_t> way;
    for (uint32_t at = to; at != from; at = came.at(at).first) {
      way.push_back(came.at(at).second);
    }
    std::reverse(way.begin(), way.end());
    return way;
  }

  // From a state on, a way with the most counted firings.
  std::vector<uint32_t> LongestWay(uint32_t state) {
    std::vector<uint32_t> whole;
    Wide wide = graph_.MakeWide();
    for (uint32_t left = most_[state]; left != 0; left = most_[state]) {
      // Within a component nothing counts: the way out of it is searched breadth first.
      CameFrom came;
      std::vector<uint32_t> found = {state};
      came[state] = {state, 0};
      std::optional<std::pair<uint32_t, uint32_t>> out;  // the state before it, and the transition
      uint32_t after = 0;
      bool goes_on = true;
      for (size_t i = 0; i < found.size() && !out; ++i) {
        graph_.ForEachSuccessor(found[i], &wide, [&](uint32_t transition, uint32_t to) {
          const uint32_t beyond = MostFrom(to);
          if (out) {
          } else if (counts_[transition] && beyond + 1 == left) {
            out = {found[i], transition};
            after = to;
            goes_on = beyond != 0;
          } else if (!counts_[transition] && beyond == left &&
                     came.try_emplace(to, found[i], transition).second) {
            found.push_back(to);
          }
        });
      }
      assert(out);
      const std::vector<uint32_t> way = WayTo(came, state, out->first);
      whole.insert(whole.end(), way.begin(), way.end());
      whole.push_back(out->second);
      state = after;
      if (!goes_on) {
        break;
      }
    }
    return whole;
  }

  const Graph& graph_;
  const Property& property_;
  std::vector<bool> counts_;     // by transition
  std::vector<uint32_t> most_;   // by state: the most firings from there on
  std::vector<bool> is_member_;  // of the component that is looked at
  Wide other_;
};

}  // namespace pheromone::petri
