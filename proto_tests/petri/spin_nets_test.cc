// Nets in Promela: Spin stores as many states as there are reachable markings, and finds the same
// faults.

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "proto_tests/petri/contest_nets.h"
#include "server/core/petri/check.h"
#include "server/formats/nets/promela.h"
#include "server/formats/nets/system_file.h"
#include "server/formats/nets/testing/naive_markings.h"
#include "server/formats/nets/testing/random_net.h"

namespace pheromone::nets {
namespace {

using petri::Net;

std::string Spin(const Net& net, const PromelaOptions& options, const std::string& flags) {
  const TemporaryFolder folder;
  const Result<std::string> model = ToPromela(net, options);
  EXPECT_TRUE(model.ok()) << model.error();
  EXPECT_TRUE(WriteFile(folder / "net.pml", model.value()).ok());
  return OutputOf(
      "spin -a net.pml && cc -w -O0 -DSAFETY -DMEMLIM=1000 -o pan pan.c && ./pan -n "
      "-m1000000 " +
          flags,
      folder);
}

size_t StoredStates(const std::string& out) {
  EXPECT_NE(out.find("errors: 0"), std::string::npos) << out;
  const size_t end = out.find(" states, stored");
  EXPECT_NE(end, std::string::npos) << out;
  const size_t begin = out.rfind('\n', end) + 1;
  return std::stoul(out.substr(begin, end - begin));
}

void ExpectTheMarkings(const Net& net, size_t expected) {
  EXPECT_EQ(ReachableMarkings(net).size(), expected) << net.name;
  EXPECT_EQ(StoredStates(Spin(net, {}, "-E")), expected) << net.name;
}

TEST(SpinNets, StoresTheReachableMarkings) {
  ExpectTheMarkings(ContestNet("kanban", 1), 160);
  ExpectTheMarkings(ContestNet("kanban", 2), 4600);
  ExpectTheMarkings(ContestNet("philosophers", 4), 81);
}

// A buffer for 3 is filled while it is empty, and emptied while somebody holds the key.
Net Buffer() {
  return {.name = "buffer",
          .places = {{.id = "full"}, {.id = "key", .tokens = 1}, {.id = "away"}, {.id = "filling"}},
          .transitions = {
              {.id = "begin", .gives = {{3}}, .inhibitors = {{0}, {3}}},
              {.id = "fill", .takes = {}, .gives = {{0}}, .reads = {{3}}, .inhibitors = {{0, 3}}},
              {.id = "end", .takes = {{3}}, .reads = {{0, 3}}},
              {.id = "empty", .takes = {{0}}, .reads = {{1}}, .inhibitors = {{3}}},
              {.id = "leave", .takes = {{1}}, .gives = {{2}}},
              {.id = "come", .takes = {{2}}, .gives = {{1}}}}};
}

// The bench of Ferreira et al. 2018 with two robots; one robot at P, in the paper's area 2.
TEST(SpinNets, StoresTheMarkingsOfTheBench) {
  const Result<Net> net =
      LoadSystem(PHEROMONE_SOURCE_DIR "/deploy/examples/nets/motion.toml", {{"robots", 2}});
  ASSERT_TRUE(net.ok()) << net.error();
  std::string at_p;
  for (const char* const id : {"leaves", "to_A", "to_B", "returns_A", "returns_B", "to_nest"}) {
    at_p += (at_p.empty() ? "p" : " + p") + std::to_string(petri::PlaceOf(net.value(), id));
  }
  const petri::CheckReport ours = petri::Check(net.value(), {.recurrence = false}).value();
  EXPECT_EQ(StoredStates(Spin(net.value(), {.assertion = at_p + " <= 1"}, "")),
            ours.explored.states);
}

TEST(SpinNets, StoresTheReachableMarkingsWithReadAndInhibitorArcs) {
  // Filling with 0 to 3, or emptying with 3 to 0; each with the key or without.
  ExpectTheMarkings(Buffer(), 2 * (4 + 4));
  std::mt19937 random(3);
  for (int tried = 0; tried < 5;) {
    const Net net = RandomNet(&random, {.places = 7, .transitions = 10, .weight = 2});
    const size_t count = ReachableMarkings(net, 2000).size();
    if (count > 30 && count <= 2000) {
      ExpectTheMarkings(net, count);
      ++tried;
    }
  }
}

TEST(SpinNets, FindsDeadlocks) {
  const std::string out = Spin(ContestNet("philosophers", 4), {}, "");
  EXPECT_NE(out.find("invalid end state"), std::string::npos) << out;
  StoredStates(Spin(ContestNet("kanban", 1), {}, ""));  // without errors
}

TEST(SpinNets, FindsMarkingsThatViolateAnAssertion) {
  StoredStates(Spin(Buffer(), {.assertion = "p0 <= 3 && p1 + p2 == 1"}, "-E"));
  const std::string out = Spin(Buffer(), {.assertion = "p0 <= 2"}, "-E");
  EXPECT_NE(out.find("assertion violated"), std::string::npos) << out;
  const std::string initial = Spin(Buffer(), {.assertion = "p1 == 0"}, "-E");
  EXPECT_NE(initial.find("assertion violated"), std::string::npos) << initial;
}

TEST(SpinNets, FindsMarkingsBeyondTheBound) {
  StoredStates(Spin(Buffer(), {.bound = 3}, "-E"));
  const std::string out = Spin(Buffer(), {.bound = 2}, "-E");
  EXPECT_NE(out.find("assertion violated (p0<=(2-1))"), std::string::npos) << out;
}

}  // namespace
}  // namespace pheromone::nets
