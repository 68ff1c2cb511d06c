// Nets for tests.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/core/petri/net.h"

namespace pheromone::petri {

inline Arc ArcOf(const Net& net, const std::string& place, uint32_t weight = 1) {
  return {static_cast<uint32_t>(PlaceOf(net, place)), weight};
}

inline std::vector<Arc> ArcsOf(const Net& net, const std::vector<std::string>& places) {
  std::vector<Arc> arcs;
  arcs.reserve(places.size());
  for (const std::string& place : places) {
    arcs.push_back(ArcOf(net, place));
  }
  return arcs;
}

/// Each philosopher takes the fork on the left, then that on the right, and puts both back.
/// 3^n markings less those in which two hold one fork.
inline Net Philosophers(int count) {
  Net net{.name = "philosophers-" + std::to_string(count)};
  const auto id = [](const std::string& what, int i) { return what + std::to_string(i); };
  for (int i = 0; i < count; ++i) {
    net.places.push_back({.id = id("thinks", i), .tokens = 1});
    net.places.push_back({.id = id("waits", i)});
    net.places.push_back({.id = id("eats", i)});
    net.places.push_back({.id = id("fork", i), .tokens = 1});
  }
  for (int i = 0; i < count; ++i) {
    const std::string right = id("fork", (i + 1) % count);
    net.transitions.push_back({.id = id("takes_left", i),
                               .takes = ArcsOf(net, {id("thinks", i), id("fork", i)}),
                               .gives = ArcsOf(net, {id("waits", i)})});
    net.transitions.push_back({.id = id("takes_right", i),
                               .takes = ArcsOf(net, {id("waits", i), right}),
                               .gives = ArcsOf(net, {id("eats", i)})});
    net.transitions.push_back({.id = id("puts_back", i),
                               .takes = ArcsOf(net, {id("eats", i)}),
                               .gives = ArcsOf(net, {id("thinks", i), id("fork", i), right})});
  }
  return net;
}

/// Four cells in a production line with a fork and a join; n kanbans each. Ciardo, Tilgner: On the
/// use of Kronecker operators for the solution of generalized stochastic Petri nets, 1996.
inline Net Kanban(uint32_t kanbans) {
  Net net{.name = "kanban-" + std::to_string(kanbans)};
  for (const char* const cell : {"1", "2", "3", "4"}) {
    const std::string of(cell);
    net.places.push_back({.id = "p" + of, .tokens = kanbans});  // free kanbans
    net.places.push_back({.id = "pm" + of});                    // at the machine
    net.places.push_back({.id = "pback" + of});                 // to be done again
    net.places.push_back({.id = "pout" + of});
  }
  const auto add = [&](const std::string& id, const std::vector<std::string>& takes,
                       const std::vector<std::string>& gives) {
    net.transitions.push_back({.id = id, .takes = ArcsOf(net, takes), .gives = ArcsOf(net, gives)});
  };
  for (const char* const cell : {"1", "2", "3", "4"}) {
    const std::string of(cell);
    add("tok" + of, {"pm" + of}, {"pout" + of});
    add("tredo" + of, {"pm" + of}, {"pback" + of});
    add("tback" + of, {"pback" + of}, {"pm" + of});
  }
  add("tin1", {"p1"}, {"pm1"});
  add("tsynch1_23", {"pout1", "p2", "p3"}, {"p1", "pm2", "pm3"});
  add("tsynch23_4", {"pout2", "pout3", "p4"}, {"p2", "p3", "pm4"});
  add("tout4", {"pout4"}, {"p4"});
  return net;
}

}  // namespace pheromone::petri
