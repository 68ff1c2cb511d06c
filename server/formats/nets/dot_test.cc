#include "server/formats/nets/dot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pheromone::nets {
namespace {

using petri::Net;
using testing::HasSubstr;
using testing::Not;

Net Gate() {
  return {.name = "gate",
          .places = {{.id = "out", .tokens = 4, .owner = "robot"},
                     {.id = "in", .name = "a<\"b\"\\n", .owner = "robot"},
                     {.id = "key", .tokens = 2},
                     {.id = "stop", .box = "STOP"}},
          .transitions = {{.id = "enter",
                           .takes = {{0, 2}, {2}},
                           .gives = {{1, 2}, {2}},
                           .inhibitors = {{3}},
                           .owner = "robot"},
                          {.id = "leave", .takes = {{1}}, .gives = {{0}}, .reads = {{2, 2}}}}};
}

TEST(Dot, DrawsEachKindOfArc) {
  const std::string dot = DotOfNet(Gate());
  EXPECT_THAT(dot, HasSubstr("  p0 -> t0 [label=\"2\"];\n"));
  EXPECT_THAT(dot, HasSubstr("  p2 -> t0 [dir=both];\n"));
  EXPECT_THAT(dot, HasSubstr("  t0 -> p1 [label=\"2\"];\n"));
  EXPECT_THAT(dot, Not(HasSubstr("t0 -> p2")));
  EXPECT_THAT(dot, HasSubstr("  p3 -> t0 [arrowhead=odot, arrowsize=1];\n"));
  EXPECT_THAT(dot, HasSubstr("  p2 -> t1 [style=dashed, arrowhead=none, label=\"2\"];\n"));
  EXPECT_THAT(dot, HasSubstr("  t1 -> p0;\n"));
}

TEST(Dot, ShowsTokensBoxesAndOwners) {
  const std::string dot = DotOfNet(Gate());
  EXPECT_THAT(dot, HasSubstr("label=\"robot\""));
  EXPECT_THAT(dot, HasSubstr("    p0 [label=\"out\\n4\"];\n"));
  EXPECT_THAT(dot, HasSubstr("    p1 [label=\"a&lt;\\\"b\\\"\\\\n\\n\"];\n"));
  EXPECT_THAT(dot, HasSubstr("    p2 [label=\"key\\n● ●\"];\n"));
  EXPECT_THAT(dot, HasSubstr("    p3 [label=\"stop\\n\", peripheries=2, tooltip=\"box STOP\"];\n"));
}

TEST(Dot, ShowsATraceAsATableOfWhatChanges) {
  const std::string dot = DotOfTrace(Gate(), {0, 1});
  const std::string more = "<td bgcolor=\"#b7e1c0\">";
  const std::string fewer = "<td bgcolor=\"#f6c9b6\">";
  EXPECT_THAT(dot, HasSubstr("<b>fired</b></td><td>out</td><td>in</td></tr>\n"));
  EXPECT_THAT(dot, HasSubstr("<i>initially</i></td><td>4</td><td> </td></tr>\n"));
  EXPECT_THAT(dot, HasSubstr(">enter</td>" + fewer + "2</td>" + more + "2</td></tr>\n"));
  EXPECT_THAT(dot, HasSubstr(">leave</td>" + more + "3</td>" + fewer + "1</td></tr>\n"));
  EXPECT_THAT(dot, HasSubstr("colspan=\"4\">unchanged: key 2</td>"));
}

}  // namespace
}  // namespace pheromone::nets
