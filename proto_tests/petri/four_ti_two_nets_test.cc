// What 4ti2 finds in the files that we write for it: the minimal semiflows that a net has by hand.

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "proto_tests/petri/contest_nets.h"
#include "server/core/petri/flows.h"
#include "server/formats/nets/four_ti_two.h"
#include "server/formats/nets/system_file.h"
#include "server/formats/nets/testing/random_net.h"

namespace pheromone::nets {
namespace {

using petri::Net;
/// The IDs in a semiflow, each as often as its weight.
using Support = std::multiset<std::string>;

std::set<Support> Semiflows(const Net& net, SemiflowsOf kind, const std::string& program,
                            const std::string& file) {
  const TemporaryFolder folder;
  const FourTiTwoProject project = ToFourTiTwo(net, kind);
  EXPECT_TRUE(WriteFile(folder / "net.mat", project.mat).ok());
  EXPECT_TRUE(WriteFile(folder / "net.sign", project.sign).ok());
  EXPECT_TRUE(WriteFile(folder / "net.rel", project.rel).ok());
  OutputOf(program + " -q net", folder);
  std::istringstream rows(ReadFile(folder / file).value());
  size_t row_count = 0;
  size_t columns = 0;
  rows >> row_count >> columns;
  std::set<Support> semiflows;
  for (size_t row = 0; row < row_count; ++row) {
    Support support;
    for (size_t i = 0; i < columns; ++i) {
      int64_t left = 0;
      for (rows >> left; left > 0; --left) {
        support.insert(kind == SemiflowsOf::kPlaces ? net.places[i].id : net.transitions[i].id);
      }
    }
    EXPECT_TRUE(semiflows.insert(support).second);
  }
  EXPECT_TRUE(rows.good());
  return semiflows;
}

void ExpectSemiflows(const Net& net, SemiflowsOf kind, const std::set<Support>& expected) {
  EXPECT_EQ(Semiflows(net, kind, "4ti2-rays", "net.ray"), expected);
  EXPECT_EQ(Semiflows(net, kind, "4ti2-qsolve", "net.qhom"), expected);
}

// A cell's cards are never lost. Cells 2 and 3 begin and end together, so that the free cards of
// one may be counted for the other's. A part is made again, or passes all cells.
TEST(FourTiTwoNets, KanbanHasSixOfPlacesAndFiveOfTransitions) {
  const Net net = ContestNet("kanban", 3);
  std::set<Support> places = {{"Pm2", "Pback2", "Pkan3", "Pout2"},
                              {"Pm3", "Pback3", "Pkan2", "Pout3"}};
  std::set<Support> transitions = {
      {"tin1", "tok1", "tsynch1_23", "tok2", "tok3", "tsynch23_4", "tok4", "tout4"}};
  for (const std::string cell : {"1", "2", "3", "4"}) {
    places.insert({"Pm" + cell, "Pback" + cell, "Pkan" + cell, "Pout" + cell});
    transitions.insert({"tredo" + cell, "tback" + cell});
  }
  ExpectSemiflows(net, SemiflowsOf::kPlaces, places);
  ExpectSemiflows(net, SemiflowsOf::kTransitions, transitions);
}

TEST(FourTiTwoNets, AMutexHasAnInvariantForEachRobotAndOneForTheArea) {
  Net net{.name = "mutex", .places = {{.id = "free", .tokens = 1}}};
  for (const std::string robot : {"a", "b"}) {
    const auto first = static_cast<uint32_t>(net.places.size());
    net.places.push_back({.id = "out_" + robot, .tokens = 1});
    net.places.push_back({.id = "in_" + robot});
    net.transitions.push_back(
        {.id = "enter_" + robot, .takes = {{0}, {first}}, .gives = {{first + 1}}});
    net.transitions.push_back(
        {.id = "leave_" + robot, .takes = {{first + 1}}, .gives = {{0}, {first}}});
  }
  ExpectSemiflows(net, SemiflowsOf::kPlaces,
                  {{"free", "in_a", "in_b"}, {"out_a", "in_a"}, {"out_b", "in_b"}});
  ExpectSemiflows(net, SemiflowsOf::kTransitions, {{"enter_a", "leave_a"}, {"enter_b", "leave_b"}});
}

std::set<Support> Own(const Net& net, const std::vector<petri::Flow>& flows, SemiflowsOf kind) {
  std::set<Support> semiflows;
  for (const petri::Flow& flow : flows) {
    Support support;
    for (const petri::FlowTerm& term : flow.terms) {
      for (int64_t left = term.weight; left > 0; --left) {
        support.insert(kind == SemiflowsOf::kPlaces ? net.places[term.index].id
                                                    : net.transitions[term.index].id);
      }
    }
    EXPECT_TRUE(semiflows.insert(support).second);
  }
  return semiflows;
}

void ExpectOwnSemiflows(const Net& net) {
  const petri::Semiflows places = petri::PlaceSemiflows(net);
  ASSERT_TRUE(places.complete);
  EXPECT_EQ(Own(net, places.flows, SemiflowsOf::kPlaces),
            Semiflows(net, SemiflowsOf::kPlaces, "4ti2-rays", "net.ray"));
  const petri::Semiflows transitions = petri::TransitionSemiflows(net);
  ASSERT_TRUE(transitions.complete);
  EXPECT_EQ(Own(net, transitions.flows, SemiflowsOf::kTransitions),
            Semiflows(net, SemiflowsOf::kTransitions, "4ti2-rays", "net.ray"));
}

TEST(FourTiTwoNets, OurOwnSemiflowsAreTheSame) {
  ExpectOwnSemiflows(ContestNet("kanban", 3));
  ExpectOwnSemiflows(ContestNet("fms", 2));
  for (const char* const name : {"motion.toml", "pheromone.toml"}) {
    const auto net = LoadSystem(std::string(PHEROMONE_SOURCE_DIR "/deploy/examples/nets/") + name);
    ASSERT_TRUE(net.ok()) << net.error();
    ExpectOwnSemiflows(net.value());
  }
  std::mt19937 random(9);
  for (int run = 0; run < 10; ++run) {
    ExpectOwnSemiflows(RandomNet(&random, {.places = 7, .transitions = 6, .weight = 3}));
  }
}

// Two of a are made into three of b, so that 3a + 2b stays.
TEST(FourTiTwoNets, WeightsAreMinimal) {
  const Net net{.name = "weights",
                .places = {{.id = "a"}, {.id = "b"}},
                .transitions = {{.id = "t", .takes = {{0, 4}}, .gives = {{1, 6}}},
                                {.id = "u", .takes = {{1, 3}}, .gives = {{0, 2}}}}};
  ExpectSemiflows(net, SemiflowsOf::kPlaces, {{"a", "a", "a", "b", "b"}});
  ExpectSemiflows(net, SemiflowsOf::kTransitions, {{"t", "u", "u"}});
}

}  // namespace
}  // namespace pheromone::nets
