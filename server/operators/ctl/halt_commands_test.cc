#include "server/operators/ctl/halt_commands.h"

#include <gtest/gtest.h>

#include <boost/json/parse.hpp>

namespace pheromone::ctl {
namespace {

const char* const kAnswer = R"({"done": true, "links": ["udp"],
    "down": [{"name": "modem", "state": "at node a"}]})";

HaltedLinks LinksOf(const char* answer, const char* cluster) {
  return DescribeHaltedLinks(boost::json::parse(answer), boost::json::parse(cluster));
}

TEST(HaltedLinks, ALinkThatIsDownIsNotTold) {
  const HaltedLinks links =
      LinksOf(R"({"links": ["udp"], "down": [{"name": "modem", "state": "unplugged"}]})", "null");
  EXPECT_EQ(links.text,
            "halt sent on 1 of 2 links\n"
            "  modem is down: unplugged; its robots were not told\n");
  EXPECT_FALSE(links.all_told);
}

TEST(HaltedLinks, ALinkOfAnotherNodeIsNotDownAndItsServerIsTold) {
  const HaltedLinks links = LinksOf(kAnswer, R"({"peers": [{"node": "a", "up": true}]})");
  EXPECT_EQ(links.text,
            "halt sent on 1 of 1 link\n"
            "  modem is at node a, to which the halt was passed on\n");
  EXPECT_TRUE(links.all_told);
}

TEST(HaltedLinks, ALinkOfANodeThatIsNotConnectedIsNotTold) {
  for (const char* const cluster :
       {R"({"peers": [{"node": "a", "up": false}, {"node": "c", "up": true}]})", "null"}) {
    const HaltedLinks links = LinksOf(kAnswer, cluster);
    EXPECT_EQ(links.text,
              "halt sent on 1 of 1 link\n"
              "  modem is at node a, which is not connected; its robots were not told\n");
    EXPECT_FALSE(links.all_told);
  }
}

}  // namespace
}  // namespace pheromone::ctl
