#include "server/formats/nets/four_ti_two.h"

#include <gtest/gtest.h>

namespace pheromone::nets {
namespace {

using Rows = std::vector<std::vector<int64_t>>;

TEST(FourTiTwo, WritesTheIncidenceMatrix) {
  const petri::Net net{.name = "n",
                       .places = {{.id = "a"}, {.id = "b"}, {.id = "c"}},
                       .transitions = {{.id = "t", .takes = {{0, 2}}, .gives = {{1}, {2}}},
                                       {.id = "u", .takes = {{1}}, .gives = {{0, 7}}}}};
  const FourTiTwoProject places = ToFourTiTwo(net, SemiflowsOf::kPlaces);
  EXPECT_EQ(places.mat, "2 3\n-2 1 1 \n7 -1 0 \n");
  EXPECT_EQ(places.sign, "1 3\n1 1 1 \n");
  EXPECT_EQ(places.rel, "1 2\n= = \n");
  const FourTiTwoProject transitions = ToFourTiTwo(net, SemiflowsOf::kTransitions);
  EXPECT_EQ(transitions.mat, "3 2\n-2 7 \n1 -1 \n1 0 \n");
  EXPECT_EQ(transitions.sign, "1 2\n1 1 \n");
  EXPECT_EQ(transitions.rel, "1 3\n= = = \n");
}

TEST(FourTiTwo, ReadsRays) {
  EXPECT_EQ(ParseFourTiTwo("a.ray", "2 3\n 0  0 1 \n 12 -1  0 \n").value(),
            (Rows{{0, 0, 1}, {12, -1, 0}}));
  EXPECT_EQ(ParseFourTiTwo("a.ray", "0 2\n").value(), Rows{});
}

TEST(FourTiTwo, SaysWhereRaysEndOrAreNotNumbers) {
  EXPECT_EQ(ParseFourTiTwo("a.ray", "2").error(),
            "a.ray: byte 1: expected the numbers of rows and columns");
  EXPECT_EQ(ParseFourTiTwo("a.ray", "1 2\n3 x").error(),
            "a.ray: byte 7: expected a number of 64 bits");
  EXPECT_EQ(ParseFourTiTwo("a.ray", "1 1\n3 4").error(),
            "a.ray: byte 7: expected no more than 1 rows of 1 numbers");
  EXPECT_EQ(ParseFourTiTwo("a.ray", "4000000000 4000000000\n1").error(),
            "a.ray: byte 21: expected 4000000000 rows of 4000000000 numbers");
}

}  // namespace
}  // namespace pheromone::nets
