// A small net that is executed: two robots, one gate, a source and two trails. For tests of what
// executes nets, beside those of the whole bench (deploy/examples/nets).
//
//   N (in):  arrive, present, pass -> inside;  X (out): leave -> lane
//   P:       choose A or B by the advice, store A or B, take
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "server/core/petri/live_rules.h"
#include "server/core/petri/net.h"

namespace pheromone::petri {

inline Net LiveGate() {
  Net net{.name = "gate"};
  const auto place = [&](const std::string& id, uint32_t tokens = 0, const std::string& tag = "",
                         const std::string& does = "") {
    net.places.push_back({.id = id, .tokens = tokens, .tag = tag, .does = does});
  };
  place("lane", 2);
  place("vacant", 1);
  place("at");
  place("wait");
  place("request");
  place("Free", 1);
  place("Green", 0, "N", "green");
  place("inside");
  place("used");
  place("out");
  place("ready", 1);
  place("depNone", 1);
  place("depA");
  place("depB");
  place("read");
  place("adv00", 1);
  place("adv01", 0, "P", "advice 01");
  place("adv10", 0, "P", "advice 10");
  place("chose");
  const auto arcs = [&](const std::vector<std::string>& ids) {
    std::vector<Arc> list;
    list.reserve(ids.size());
    for (const std::string& id : ids) {
      list.push_back({static_cast<uint32_t>(PlaceOf(net, id))});
    }
    return list;
  };
  const auto add = [&](const std::string& id, const std::string& owner, const std::string& tag,
                       const std::string& does, const std::vector<std::string>& takes,
                       const std::vector<std::string>& gives,
                       const std::vector<std::string>& reads = {}) {
    net.transitions.push_back({.id = id,
                               .takes = arcs(takes),
                               .gives = arcs(gives),
                               .reads = arcs(reads),
                               .owner = owner,
                               .tag = tag,
                               .does = does});
  };
  const std::string robot = "robot";
  const std::string reader = "environment";
  add("arrive", robot, "N", "", {"lane", "vacant"}, {"at"});
  add("present", robot, "N", "present", {"at"}, {"wait", "request"});
  add("WriteGreen", reader, "N", "", {"request", "Free"}, {"Green"});
  add("pass", robot, "N", "pass", {"wait", "Green"}, {"inside", "vacant"});
  add("exit", robot, "X", "leave", {"inside"}, {"lane", "out"});
  add("release", reader, "X", "", {"out"}, {"Free"});
  add("read_A", robot, "P", "choose A", {}, {"chose"}, {"inside", "adv01"});
  add("read_B", robot, "P", "choose B", {}, {"chose"}, {"inside", "adv10"});
  add("read_any_A", robot, "P", "choose A", {}, {"chose"}, {"inside", "adv00"});
  add("store_A", robot, "P", "store A", {"depNone"}, {"depA"}, {"inside"});
  add("store_B", robot, "P", "store B", {"depNone"}, {"depB"}, {"inside"});
  add("take", robot, "P", "take", {}, {}, {"inside"});
  add("reads_A", reader, "P", "add A", {"depA", "ready"}, {"depNone", "read"});
  add("reads_B", reader, "P", "add B", {"depB", "ready"}, {"depNone", "read"});
  for (const std::string from : {"adv00", "adv01", "adv10"}) {
    for (const std::string to : {"00", "01", "10"}) {
      add("deposit_" + from + "_" + to, reader, "P", "advise " + to, {"read", from},
          {"ready", "adv" + to});
      if (from != "adv" + to) {
        add("timer_" + from + "_" + to, reader, "P", "advise " + to + " anew", {from}, {"adv" + to},
            {"ready"});
      }
    }
  }
  return net;
}

inline LiveSettings LiveGateSettings() {
  return {.name = "gate",
          .net = LiveGate(),
          .robot_hash = 0x1234,
          .tags = {{"N", "north", {1}}, {"X", "exit", {4}}, {"P", "pheromone", {2, 3, 7}}},
          .law = EvaporationLaw::kE3,
          .rate_milli = 1'000};
}

}  // namespace pheromone::petri
