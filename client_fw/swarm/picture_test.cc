#include "client_fw/swarm/picture.h"

#include <gtest/gtest.h>

#include "client_fw/swarm/path_experiment.h"
#include "server/base/testing/count.h"

namespace pheromone::swarm {
namespace {

TEST(DrawPathPicture, DrawsEachNodeTheWayAndTheLegend) {
  const field::Field field(EngineConfigOf({}).field);
  const PathRun run = FollowPath({.duration_ms = 1000}, 1);
  const std::string svg = DrawPathPicture("A <title> & more", field, PathOf(Shape::kLine),
                                          {{"the way", "#123456", run.track}}, 0);
  EXPECT_EQ(CountOf(svg, "<circle"), 2 * field.node_count());
  EXPECT_EQ(CountOf(svg, "<polyline"), 2u);  // the path and the way
  EXPECT_EQ(CountOf(svg, ">the way</text>"), 1u);
  EXPECT_EQ(CountOf(svg, "A &lt;title&gt; &amp; more"), 1u);
  EXPECT_EQ(svg.rfind("</svg>\n"), svg.size() - 7);
}

TEST(DrawPathPicture, LeavesOutAWayThatNeverBegan) {
  const field::Field field(EngineConfigOf({}).field);
  const std::string svg =
      DrawPathPicture("t", field, PathOf(Shape::kLine), {{"none", "#123456", {}}}, 0);
  EXPECT_EQ(CountOf(svg, "<polyline"), 1u);
}

}  // namespace
}  // namespace pheromone::swarm
