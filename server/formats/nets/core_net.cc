#include "server/formats/nets/core_net.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <string_view>
#include <unordered_set>

namespace pheromone::nets {
namespace {

using petri::Arc;
using petri::Net;
using petri::Place;
using petri::Transition;

uint32_t WeightAt(const std::vector<Arc>& arcs, uint32_t place) {
  const auto found =
      std::find_if(arcs.begin(), arcs.end(), [&](const Arc& arc) { return arc.place == place; });
  return found == arcs.end() ? 0 : found->weight;
}

void SetWeight(std::vector<Arc>* arcs, uint32_t place, uint32_t weight) {
  const auto found =
      std::find_if(arcs->begin(), arcs->end(), [&](const Arc& arc) { return arc.place == place; });
  if (found != arcs->end()) {
    found->weight = weight;
  } else if (weight > 0) {
    arcs->push_back({place, weight});
  }
}

// Takes and gives back so much more that `needed` tokens are there.
void Require(Transition* transition, uint32_t place, uint32_t needed) {
  const uint32_t taken = WeightAt(transition->takes, place);
  if (taken >= needed) {
    return;
  }
  const uint32_t given = WeightAt(transition->gives, place);
  SetWeight(&transition->takes, place, needed);
  SetWeight(&transition->gives, place, given + (needed - taken));
}

std::vector<bool> Inhibiting(const Net& net) {
  std::vector<bool> inhibits(net.places.size());
  for (const Transition& transition : net.transitions) {
    for (const Arc& arc : transition.inhibitors) {
      inhibits[arc.place] = true;
    }
  }
  return inhibits;
}

std::string FreeId(std::string_view wanted, std::unordered_set<std::string>* ids) {
  std::string id(wanted);
  for (int number = 2; !ids->insert(id).second; ++number) {
    id = std::string(wanted) + std::to_string(number);
  }
  return id;
}

std::unordered_set<std::string> IdsOf(const Net& net) {
  std::unordered_set<std::string> ids;
  for (const Place& place : net.places) {
    ids.insert(place.id);
  }
  for (const Transition& transition : net.transitions) {
    ids.insert(transition.id);
  }
  return ids;
}

}  // namespace

Net WithoutReads(const Net& net) {
  Net core = net;
  for (Transition& transition : core.transitions) {
    for (const Arc& arc : transition.reads) {
      Require(&transition, arc.place, arc.weight);
    }
    transition.reads.clear();
  }
  return core;
}

Result<Net> CoreNet(const Net& net, const std::vector<uint32_t>& bounds) {
  assert(bounds.size() == net.places.size());
  const std::vector<bool> inhibits = Inhibiting(net);
  std::unordered_set<std::string> ids = IdsOf(net);
  Net core = WithoutReads(net);
  std::vector<uint32_t> complement(net.places.size());
  for (uint32_t p = 0; p < net.places.size(); ++p) {
    if (!inhibits[p]) {
      continue;
    }
    const Place& place = net.places[p];
    if (bounds[p] == 0 || bounds[p] < place.tokens || bounds[p] > petri::kMaxTokens) {
      return Error{"place \"" + place.id + "\" has an inhibitor arc and " +
                   (bounds[p] == 0 ? "no known bound" : "a bound of " + std::to_string(bounds[p])) +
                   ", expected a bound of " + std::to_string(std::max(1u, place.tokens)) + " to " +
                   std::to_string(petri::kMaxTokens)};
    }
    complement[p] = static_cast<uint32_t>(core.places.size());
    core.places.push_back({.id = FreeId(place.id + "_complement", &ids),
                           .name = place.name.empty() ? "" : place.name + " (complement)",
                           .tokens = bounds[p] - place.tokens,
                           .owner = place.owner,
                           .tag = place.tag,
                           .does = place.does});
  }
  for (size_t t = 0; t < net.transitions.size(); ++t) {
    const Transition& before = net.transitions[t];
    Transition& after = core.transitions[t];
    for (const Arc& arc : before.takes) {
      const uint32_t given = WeightAt(before.gives, arc.place);
      if (inhibits[arc.place] && arc.weight > given) {
        after.gives.push_back({complement[arc.place], arc.weight - given});
      }
    }
    for (const Arc& arc : before.gives) {
      const uint32_t taken = WeightAt(before.takes, arc.place);
      if (inhibits[arc.place] && arc.weight > taken) {
        after.takes.push_back({complement[arc.place], arc.weight - taken});
      }
    }
    for (const Arc& arc : before.inhibitors) {
      if (arc.weight <= bounds[arc.place]) {
        Require(&after, complement[arc.place], bounds[arc.place] - arc.weight + 1);
      }
    }
    after.inhibitors.clear();
  }
  if (const Status sound = CheckNet(core); !sound.ok()) {  // weights that are too large together
    return sound.error();
  }
  return core;
}

}  // namespace pheromone::nets
