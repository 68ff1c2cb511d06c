#include "server/core/petri/net.h"

#include <algorithm>
#include <unordered_set>

namespace pheromone::petri {
namespace {

std::string CheckArcs(const Net& net, const Transition& transition, std::string_view list,
                      const std::vector<Arc>& arcs) {
  std::unordered_set<uint32_t> seen;
  for (const Arc& arc : arcs) {
    std::string wrong = "transition \"" + transition.id + "\" " + std::string(list);
    if (arc.place >= net.places.size()) {
      return wrong += " place number " + std::to_string(arc.place) + ", but the net has " +
                      std::to_string(net.places.size());
    }
    wrong += " \"" + net.places[arc.place].id;
    if (!seen.insert(arc.place).second) {
      return wrong += "\" twice; expected one arc with the sum of the weights";
    }
    if (arc.weight == 0 || arc.weight > kMaxTokens) {
      return wrong += "\" with the weight " + std::to_string(arc.weight) + ", expected 1 to " +
                      std::to_string(kMaxTokens);
    }
  }
  return "";
}

std::string CheckId(std::string_view kind, const std::string& id,
                    std::unordered_set<std::string_view>* ids) {
  if (id.empty()) {
    return "a " + std::string(kind) + " has no ID";
  }
  return ids->insert(id).second ? "" : "the ID \"" + id + "\" is given twice";
}

std::string Wrong(const Net& net) {
  if (net.places.size() > kMaxNodes || net.transitions.size() > kMaxNodes) {
    return std::to_string(net.places.size()) + " places and " +
           std::to_string(net.transitions.size()) + " transitions, expected " +
           std::to_string(kMaxNodes) + " at most";
  }
  std::unordered_set<std::string_view> ids;
  for (const Place& place : net.places) {
    if (std::string wrong = CheckId("place", place.id, &ids); !wrong.empty()) {
      return wrong;
    }
    if (place.tokens > kMaxTokens) {
      return "place \"" + place.id + "\" has " + std::to_string(place.tokens) +
             " tokens, expected " + std::to_string(kMaxTokens) + " at most";
    }
  }
  for (const Transition& transition : net.transitions) {
    std::string wrong = CheckId("transition", transition.id, &ids);
    for (const auto& [list, arcs] : {std::pair{"takes from", &transition.takes},
                                     {"gives to", &transition.gives},
                                     {"reads", &transition.reads},
                                     {"is inhibited by", &transition.inhibitors}}) {
      if (wrong.empty()) {
        wrong = CheckArcs(net, transition, list, *arcs);
      }
    }
    if (!wrong.empty()) {
      return wrong;
    }
  }
  return "";
}

template <typename Nodes>
size_t Find(const Nodes& nodes, std::string_view id) {
  const auto found =
      std::find_if(nodes.begin(), nodes.end(), [&](const auto& node) { return node.id == id; });
  return static_cast<size_t>(found - nodes.begin());
}

}  // namespace

Status CheckNet(const Net& net) {
  const std::string wrong = Wrong(net);
  return wrong.empty() ? Ok() : Status(Error{"net \"" + net.name + "\": " + wrong});
}

size_t PlaceOf(const Net& net, std::string_view id) {
  return Find(net.places, id);
}

size_t TransitionOf(const Net& net, std::string_view id) {
  return Find(net.transitions, id);
}

Marking InitialMarking(const Net& net) {
  Marking marking(static_cast<Eigen::Index>(net.places.size()));
  for (size_t place = 0; place < net.places.size(); ++place) {
    marking[static_cast<Eigen::Index>(place)] = static_cast<int32_t>(net.places[place].tokens);
  }
  return marking;
}

IncidenceMatrix IncidenceOf(const Net& net) {
  IncidenceMatrix incidence =
      IncidenceMatrix::Zero(static_cast<Eigen::Index>(net.transitions.size()),
                            static_cast<Eigen::Index>(net.places.size()));
  for (size_t row = 0; row < net.transitions.size(); ++row) {
    const auto at = static_cast<Eigen::Index>(row);
    for (const Arc& arc : net.transitions[row].gives) {
      incidence(at, arc.place) += static_cast<int32_t>(arc.weight);
    }
    for (const Arc& arc : net.transitions[row].takes) {
      incidence(at, arc.place) -= static_cast<int32_t>(arc.weight);
    }
  }
  return incidence;
}

bool IsEnabled(const Net& net, size_t transition, const Marking& marking) {
  const Transition& it = net.transitions[transition];
  const auto has = [&](const Arc& arc) {
    return marking[arc.place] >= static_cast<int32_t>(arc.weight);
  };
  return std::all_of(it.takes.begin(), it.takes.end(), has) &&
         std::all_of(it.reads.begin(), it.reads.end(), has) &&
         std::none_of(it.inhibitors.begin(), it.inhibitors.end(), has);
}

Marking Fire(const Net& net, size_t transition, const Marking& marking) {
  Marking after = marking;
  for (const Arc& arc : net.transitions[transition].takes) {
    after[arc.place] -= static_cast<int32_t>(arc.weight);
  }
  for (const Arc& arc : net.transitions[transition].gives) {
    after[arc.place] += static_cast<int32_t>(arc.weight);
  }
  return after;
}

}  // namespace pheromone::petri
