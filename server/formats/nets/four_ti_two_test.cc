#include "server/formats/nets/four_ti_two.h"

#include <gtest/gtest.h>

namespace pheromone::nets {
namespace {

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

}  // namespace
}  // namespace pheromone::nets
