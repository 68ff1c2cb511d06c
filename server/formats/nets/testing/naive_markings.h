// All reachable markings, one after the other: slow, but obviously right.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "server/core/petri/net.h"

namespace pheromone::nets {

using NaiveMarkings = std::set<std::vector<int32_t>>;

inline NaiveMarkings ReachableMarkings(const petri::Net& net, size_t at_most = 1'000'000) {
  const auto key = [](const petri::Marking& marking) {
    return std::vector<int32_t>(marking.begin(), marking.end());
  };
  std::vector<petri::Marking> waiting = {petri::InitialMarking(net)};
  NaiveMarkings known = {key(waiting[0])};
  while (!waiting.empty() && known.size() <= at_most) {
    const petri::Marking marking = waiting.back();
    waiting.pop_back();
    for (size_t transition = 0; transition < net.transitions.size(); ++transition) {
      if (petri::IsEnabled(net, transition, marking)) {
        petri::Marking after = petri::Fire(net, transition, marking);
        if (known.insert(key(after)).second) {
          waiting.push_back(std::move(after));
        }
      }
    }
  }
  return known;
}

}  // namespace pheromone::nets
