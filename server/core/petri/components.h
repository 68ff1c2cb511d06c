// Strongly connected components of a PackedGraph.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/core/petri/state_space.h"

namespace pheromone::petri {

/// Tarjan's algorithm (1972) on the states for which `inside(wide)` holds. `take(members, leaves)`
/// gets each component after all that can be reached from it; `leaves`: one can. False if the
/// memory does not suffice.
template <typename Graph, typename Inside, typename Take>
bool FindComponents(const Graph& graph, const SearchLimits& limits, const Inside& inside,
                    const Take& take) {
  struct Frame {
    uint32_t state;
    uint32_t low;
    size_t first_target;  // those before it are done
    bool leaves;
  };

  constexpr uint32_t kDone = std::numeric_limits<uint32_t>::max();
  constexpr uint32_t kOutside = kDone - 1;
  const uint64_t bytes = graph.bytes() + 4 * graph.size();
  if (bytes > limits.max_bytes) {
    return false;
  }
  std::vector<uint32_t> order(graph.size());  // 0: not yet seen
  std::vector<uint32_t> open;                 // states whose component is not known
  std::vector<Frame> frames;
  std::vector<uint32_t> targets;  // of the states in `frames`
  std::vector<uint32_t> members;
  auto wide = graph.MakeWide();
  uint32_t count = 0;
  const auto enter = [&](uint32_t state) {
    graph.Unpack(state, &wide);
    if (!inside(wide)) {
      order[state] = kOutside;
      return;
    }
    order[state] = ++count;
    open.push_back(state);
    frames.push_back({state, count, targets.size(), false});
    graph.ForEachSuccessor(state, &wide, [&](uint32_t, uint32_t to) { targets.push_back(to); });
  };
  for (uint32_t root = 0; root < graph.size(); ++root) {
    if (order[root] == 0) {
      enter(root);
    }
    while (!frames.empty()) {
      Frame& frame = frames.back();
      if (targets.size() > frame.first_target) {
        const uint32_t to = targets.back();
        if (order[to] == 0) {
          enter(to);
          if (order[to] == kOutside) {
            targets.pop_back();
          }
          continue;  // it is looked at again afterwards
        }
        targets.pop_back();
        if (order[to] == kDone) {
          frame.leaves = true;
        } else if (order[to] != kOutside) {
          frame.low = std::min(frame.low, order[to]);
        }
        continue;
      }
      if (bytes + 4 * (open.capacity() + targets.capacity()) + sizeof(Frame) * frames.capacity() >
          limits.max_bytes) {
        return false;
      }
      const Frame done = frame;
      frames.pop_back();
      if (done.low < order[done.state]) {
        frames.back().low = std::min(frames.back().low, done.low);
        frames.back().leaves = frames.back().leaves || done.leaves;
        continue;
      }
      members.clear();
      uint32_t member = 0;
      do {
        member = open.back();
        open.pop_back();
        order[member] = kDone;
        members.push_back(member);
      } while (member != done.state);
      take(members, done.leaves);
    }
  }
  return true;
}

}  // namespace pheromone::petri
