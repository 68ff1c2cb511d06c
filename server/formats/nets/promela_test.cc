#include "server/formats/nets/promela.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pheromone::nets {
namespace {

using petri::Net;
using testing::HasSubstr;

TEST(Promela, HasAVariableForEachPlaceAndAStepForEachTransition) {
  const Net net{.name = "n",
                .places = {{.id = "free", .tokens = 1}, {.id = "a*/b"}},
                .transitions = {
                    {.id = "t", .takes = {{0}, {1, 3}}, .gives = {{1, 5}}, .inhibitors = {{1, 9}}},
                    {.id = "u", .reads = {{1, 2}}},
                    {.id = "v", .gives = {{0}}}}};
  EXPECT_EQ(ToPromela(net, {.bound = 20, .assertion = "p0 <= 1"}).value(),
            R"(/* "n" */
byte p0 = 1;  /* "free" */
byte p1 = 0;  /* "a* /b" */

active proctype net() {
  do
  :: !(p0 <= 1) -> assert(false)
  :: d_step { p0 >= 1 && p1 >= 3 && p1 < 9 -> p0 = p0 - 1; assert(p1 <= 20 - 2); p1 = p1 + 2; }  /* "t" */
  :: d_step { p1 >= 2 -> skip }  /* "u" */
  :: d_step { true -> assert(p0 <= 20 - 1); p0 = p0 + 1; }  /* "v" */
  od
}
)");
}

TEST(Promela, ChoosesTheTypeByTheBound) {
  const Net net{.name = "n", .places = {{.id = "p", .tokens = 300}}};
  EXPECT_THAT(ToPromela(net, {.bound = 300}).value(), HasSubstr("short p0 = 300;"));
  EXPECT_THAT(ToPromela(net, {.bound = 40'000}).value(), HasSubstr("int p0 = 300;"));
  EXPECT_EQ(ToPromela(net, {}).error(),
            "place \"p\" has 300 tokens, expected at most the bound 255");
  EXPECT_EQ(ToPromela(net, {.bound = 2'000'000'000}).error(),
            "a bound of 2000000000, expected at most 1000000000");
}

}  // namespace
}  // namespace pheromone::nets
