// Nets at random for tests, with all that a net may have.
#pragma once

#include <algorithm>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "server/core/petri/net.h"

namespace pheromone::nets {

struct RandomNetLimits {
  size_t places = 6;
  size_t transitions = 6;
  uint32_t weight = 3;
  uint32_t tokens = 3;
};

/// IDs p0, p1 ... and t0, t1 ...; nothing else has a name.
inline petri::Net RandomNet(std::mt19937* random, const RandomNetLimits& limits = {}) {
  const auto upto = [&](size_t most) { return static_cast<uint32_t>((*random)() % (most + 1)); };
  petri::Net net{.name = "random"};
  const size_t places = 1 + upto(limits.places - 1);
  for (size_t i = 0; i < places; ++i) {
    net.places.push_back({.id = "p" + std::to_string(i), .tokens = upto(limits.tokens)});
  }
  const auto arcs = [&](size_t most, uint32_t weight) {
    std::vector<uint32_t> all(places);
    std::iota(all.begin(), all.end(), 0u);
    std::shuffle(all.begin(), all.end(), *random);
    all.resize(std::min<size_t>(upto(most), places));
    std::vector<petri::Arc> chosen;
    for (const uint32_t place : all) {
      chosen.push_back({place, 1 + upto(weight - 1)});
    }
    return chosen;
  };
  const size_t transitions = upto(limits.transitions);
  for (size_t i = 0; i < transitions; ++i) {
    net.transitions.push_back({.id = "t" + std::to_string(i),
                               .takes = arcs(2, limits.weight),
                               .gives = arcs(2, limits.weight),
                               .reads = arcs(1, limits.weight),
                               .inhibitors = arcs(1, limits.weight + limits.tokens)});
  }
  return net;
}

/// Any bytes but mostly letters, and what XML and Graphviz treat specially.
inline std::string RandomText(std::mt19937* random) {
  static const std::vector<std::string> pieces = {"a",      "B",
                                                  "7",      " ",
                                                  "-",      ".",
                                                  "_",      ":",
                                                  "<",      ">",
                                                  "&",      "\"",
                                                  "'",      "\n",
                                                  "\t",     "\r",
                                                  "]]>",    "&amp;",
                                                  "%41",    "\\",
                                                  "\\n",    "µ",
                                                  "\u4E2D", "🐜",
                                                  "\xFF",   "\x01",
                                                  "{|}",    "\xC3",
                                                  "n1",     "<!--",
                                                  "#",      "\x7F",
                                                  "=",      std::string(1, '\0')};
  std::string text;
  for (uint32_t left = static_cast<uint32_t>((*random)() % 6); left > 0; --left) {
    text += pieces[(*random)() % pieces.size()];
  }
  return text;
}

/// The same net with any text as its names, IDs, owners, tags, boxes and claims.
inline petri::Net WithRandomTexts(petri::Net net, std::mt19937* random) {
  net.name = RandomText(random);
  const auto fill = [&](auto* node) {
    if ((*random)() % 2 == 0) {
      node->id = RandomText(random) + "#" + node->id;
    }
    node->name = RandomText(random);
    node->owner = RandomText(random);
    node->tag = RandomText(random);
  };
  for (petri::Place& place : net.places) {
    fill(&place);
    place.box = RandomText(random);
  }
  for (petri::Transition& transition : net.transitions) {
    fill(&transition);
  }
  for (uint32_t left = static_cast<uint32_t>((*random)() % 3); left > 0; --left) {
    net.claims.push_back({.id = RandomText(random), .text = RandomText(random)});
  }
  return net;
}

}  // namespace pheromone::nets
