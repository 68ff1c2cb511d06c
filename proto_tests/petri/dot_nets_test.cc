// That Graphviz draws what we write for it, whatever names a net has, without a word of complaint.

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include <pugixml.hpp>

#include "proto_tests/petri/contest_nets.h"
#include "server/formats/nets/dot.h"
#include "server/formats/nets/testing/random_net.h"

namespace pheromone::nets {
namespace {

using petri::Net;

// The elements of each class that Graphviz gives to its <g>: "node", "edge", "cluster".
struct Drawn {
  size_t nodes = 0;
  size_t edges = 0;
  size_t clusters = 0;

  bool operator==(const Drawn&) const = default;
};

pugi::xml_document Svg(const std::string& dot) {
  const TemporaryFolder folder;
  EXPECT_TRUE(WriteFile(folder / "a.dot", dot).ok());
  EXPECT_EQ(OutputOf("dot -Tsvg a.dot -o a.svg", folder), "") << dot;
  const std::string svg = ReadFile(folder / "a.svg").value();
  pugi::xml_document document;
  EXPECT_TRUE(document.load_string(svg.c_str())) << svg;
  return document;
}

Drawn CountOfGraph(const pugi::xml_document& svg) {
  Drawn drawn;
  for (const pugi::xpath_node& it : svg.select_nodes("//*[local-name()='g']")) {
    const std::string kind = it.node().attribute("class").value();
    drawn.nodes += kind == "node";
    drawn.edges += kind == "edge";
    drawn.clusters += kind == "cluster";
  }
  return drawn;
}

TEST(DotNets, DrawsEachNodeAndArcOfTheContestsNets) {
  EXPECT_EQ(CountOfGraph(Svg(DotOfNet(ContestNet("kanban", 2)))),
            (Drawn{.nodes = 32, .edges = 40}));
}

TEST(DotNets, DrawsAnyName) {
  std::mt19937 random(5);
  for (int i = 0; i < 20; ++i) {
    const Net net = WithRandomTexts(RandomNet(&random, {.places = 12, .transitions = 8}), &random);
    EXPECT_EQ(CountOfGraph(Svg(DotOfNet(net))).nodes, net.places.size() + net.transitions.size());
    Svg(DotOfTrace(net, {}));
  }
}

// The philosophers take their left forks.
TEST(DotNets, DrawsATraceAsATable) {
  const pugi::xml_document svg = Svg(DotOfTrace(ContestNet("philosophers", 3), {0, 5, 10}));
  EXPECT_EQ(CountOfGraph(svg), Drawn{.nodes = 1});
  std::vector<std::string> texts;
  for (const pugi::xpath_node& it : svg.select_nodes("//*[local-name()='text']")) {
    texts.emplace_back(it.node().child_value());
  }
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "FF1a_2"), 1);
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "Catch1_2"), 1);
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "Catch2_2"), 0);
}

}  // namespace
}  // namespace pheromone::nets
