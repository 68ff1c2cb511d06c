#include "server/core/petri/reduction.h"

#include <algorithm>

namespace pheromone::petri {
namespace {

// How many transitions each place has of each kind of arc.
struct Uses {
  std::vector<uint32_t> takers;
  std::vector<uint32_t> givers;
  std::vector<uint32_t> readers;
  std::vector<uint32_t> inhibited;
};

Uses UsesOf(const Net& net) {
  const std::vector<uint32_t> none(net.places.size());
  Uses uses{none, none, none, none};
  for (const Transition& transition : net.transitions) {
    for (const auto& [arcs, count] : {std::pair{&transition.takes, &uses.takers},
                                      {&transition.gives, &uses.givers},
                                      {&transition.reads, &uses.readers},
                                      {&transition.inhibitors, &uses.inhibited}}) {
      for (const Arc& arc : *arcs) {
        ++(*count)[arc.place];
      }
    }
  }
  return uses;
}

bool Commutes(const Transition& it, const Uses& uses) {
  const auto all = [](const std::vector<Arc>& arcs, const auto& test) {
    return std::all_of(arcs.begin(), arcs.end(), [&](const Arc& arc) { return test(arc.place); });
  };
  return !it.takes.empty() &&
         all(it.takes, [&](uint32_t p) { return uses.takers[p] == 1 && uses.readers[p] == 0; }) &&
         all(it.gives, [&](uint32_t p) { return uses.inhibited[p] == 0; }) &&
         all(it.reads, [&](uint32_t p) { return uses.takers[p] == 0; }) &&
         all(it.inhibitors, [&](uint32_t p) { return uses.givers[p] == 0; });
}

}  // namespace

std::vector<uint32_t> EagerTransitions(const Net& net, const std::vector<uint32_t>& visible_places,
                                       const std::vector<uint32_t>& visible_transitions) {
  const Uses uses = UsesOf(net);
  std::vector<bool> is_visible(net.places.size());
  for (const uint32_t place : visible_places) {
    is_visible[place] = true;
  }
  const auto changes_visible = [&](const Transition& it) {
    const auto visible = [&](const Arc& arc) { return is_visible[arc.place]; };
    return std::any_of(it.takes.begin(), it.takes.end(), visible) ||
           std::any_of(it.gives.begin(), it.gives.end(), visible);
  };
  std::vector<uint32_t> candidates;
  for (uint32_t t = 0; t < net.transitions.size(); ++t) {
    const bool is_named = std::find(visible_transitions.begin(), visible_transitions.end(), t) !=
                          visible_transitions.end();
    if (!is_named && Commutes(net.transitions[t], uses) && !changes_visible(net.transitions[t])) {
      candidates.push_back(t);
    }
  }
  // Taken from the end of chains: one whose places feed only such as are taken, or none of them.
  // What is left goes round in circles, or leads into one.
  std::vector<uint32_t> eager;
  std::vector<bool> is_fed(net.places.size());  // taken from by a candidate that is left
  bool goes_on = true;
  while (goes_on) {
    goes_on = false;
    std::fill(is_fed.begin(), is_fed.end(), false);
    for (const uint32_t t : candidates) {
      for (const Arc& arc : net.transitions[t].takes) {
        is_fed[arc.place] = true;
      }
    }
    std::vector<uint32_t> left;
    for (const uint32_t t : candidates) {
      const auto& gives = net.transitions[t].gives;
      if (std::any_of(gives.begin(), gives.end(),
                      [&](const Arc& arc) { return is_fed[arc.place]; })) {
        left.push_back(t);
      } else {
        eager.push_back(t);
        goes_on = true;
      }
    }
    candidates = std::move(left);
  }
  std::sort(eager.begin(), eager.end());
  return eager;
}

}  // namespace pheromone::petri
