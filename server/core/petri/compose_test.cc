#include "server/core/petri/compose.h"

#include <gtest/gtest.h>

namespace pheromone::petri {
namespace {

// Goes from its lane to the place behind it, once `go` has been said.
Net Gate() {
  return {.name = "gate",
          .places = {{.id = "lane"}, {.id = "go", .box = "go"}, {.id = "behind", .tag = "T"}},
          .transitions = {{.id = "pass", .takes = {{0}, {1}}, .gives = {{2}}}},
          .claims = {{"safe", "always behind + 2 * go <= 1"}, {"quick", "live pass"}}};
}

Net Caller() {
  return {.name = "caller",
          .places = {{.id = "go", .box = "go"}, {.id = "nest", .tokens = 3}},
          .transitions = {{.id = "call", .gives = {{0}}, .inhibitors = {{0}}}}};
}

std::string ErrorOf(const std::vector<Instance>& instances) {
  const Result<Net> net = Compose("whole", instances);
  return net.ErrorOr("");
}

TEST(Compose, PrefixesIdsAndJoinsBoxesAndBoundPlaces) {
  const Result<Net> net =
      Compose("whole", {{.net = Gate(), .as = "N1", .with = {{"lane", "nest"}}},
                        {.net = Gate(), .as = "N2", .with = {{"lane", "N1.behind"}}},
                        {.net = Caller()}});
  ASSERT_TRUE(net.ok()) << net.error();
  const Net expected{.name = "whole",
                     .places = {{.id = "nest", .tokens = 3},
                                {.id = "go", .box = "go"},
                                {.id = "N1.behind", .tag = "T"},
                                {.id = "N2.behind", .tag = "T"}},
                     .transitions = {{.id = "N1.pass", .takes = {{0}, {1}}, .gives = {{2}}},
                                     {.id = "N2.pass", .takes = {{2}, {1}}, .gives = {{3}}},
                                     {.id = "call", .gives = {{1}}, .inhibitors = {{1}}}},
                     .claims = {{"N1.safe", "always N1.behind + 2 * go <= 1"},
                                {"N1.quick", "live N1.pass"},
                                {"N2.safe", "always N2.behind + 2 * go <= 1"},
                                {"N2.quick", "live N2.pass"}}};
  EXPECT_EQ(net.value(), expected);
}

TEST(Compose, ABoxIsBoundToAnotherBox) {
  Net caller = Caller();
  caller.places[0].box = "GoNorth";
  const Result<Net> net =
      Compose("whole", {{.net = Gate(), .as = "N1", .with = {{"go", "GoNorth"}}}, {.net = caller}});
  ASSERT_TRUE(net.ok()) << net.error();
  const size_t box = PlaceOf(net.value(), "GoNorth");
  ASSERT_LT(box, net.value().places.size());
  EXPECT_EQ(net.value().places[box].box, "GoNorth");
  EXPECT_EQ(PlaceOf(net.value(), "go"), net.value().places.size());
}

TEST(Compose, TokensAreGivenOnceOrAlike) {
  Net gate = Gate();
  const Instance bound{.net = gate, .as = "N1", .with = {{"lane", "nest"}}};
  EXPECT_EQ(ErrorOf({bound, {.net = Caller()}}), "");
  gate.places[0].tokens = 3;
  EXPECT_EQ(ErrorOf({{.net = gate, .as = "N1", .with = {{"lane", "nest"}}}, {.net = Caller()}}),
            "");
  gate.places[0].tokens = 2;
  EXPECT_EQ(ErrorOf({{.net = gate, .as = "N1", .with = {{"lane", "nest"}}}, {.net = Caller()}}),
            "place \"nest\" has 2 tokens in instance \"N1\" and 3 in net \"caller\", expected them "
            "in one, or the same in both");
}

TEST(Compose, SaysWhatDoesNotFit) {
  EXPECT_EQ(ErrorOf({{.net = Gate(), .as = "N1", .with = {{"lame", "nest"}}}}),
            "instance \"N1\" binds \"lame\", expected a place of net \"gate\"");
  EXPECT_EQ(ErrorOf({{.net = Gate(), .as = "N1", .with = {{"lane", "nset"}}}, {.net = Caller()}}),
            "net \"whole\": instance \"N1\" binds a place to \"nset\", which no instance has");
  EXPECT_EQ(ErrorOf({{.net = Gate(), .as = "N1"}, {.net = Gate(), .as = "N1"}}),
            "place \"N1.lane\" is both in instance \"N1\" and in instance \"N1\", expected it to "
            "be bound in one, or a box");
  EXPECT_EQ(ErrorOf({{.net = Gate(), .as = "N1", .with = {{"lane", "go"}}}}),
            "net \"whole\": transition \"N1.pass\" takes from \"go\" twice; expected one arc with "
            "the sum of the weights");
  EXPECT_EQ(ErrorOf({{.net = {.name = "a", .claims = {{"c", "live t"}}}},
                     {.net = {.name = "b", .claims = {{"c", "live t"}}}}}),
            "claim \"c\" of net \"b\" is given twice, expected another ID");
  Net broken = Gate();
  broken.places[1].id = "lane";
  EXPECT_EQ(ErrorOf({{.net = broken}}), "net \"gate\": the ID \"lane\" is given twice");
}

}  // namespace
}  // namespace pheromone::petri
