#include "server/operators/ctl/halt_commands.h"

#include <gtest/gtest.h>

#include <boost/json/parse.hpp>

namespace pheromone::ctl {
namespace {

const char* const kAnswer = R"({"done": true, "links": ["udp"],
    "down": [{"name": "modem", "state": "at node a", "role": "elsewhere", "nodes": ["a"],
              "owner": "a"}]})";

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

TEST(HaltedLinks, ALinkOfWhichOneOfSeveralNodesSendsIsToldIfAllOfThemAre) {
  const auto text_of = [](const char* cluster) {
    return LinksOf(R"({"links": [], "down": [{"name": "modem", "state": "at node a or c",
                       "role": "elsewhere", "nodes": ["a", "c"], "owner": null}]})",
                   cluster)
        .text;
  };
  EXPECT_EQ(text_of(R"({"peers": [{"node": "a", "up": true}, {"node": "c", "up": true}]})"),
            "halt sent on 0 of 0 links\n"
            "  modem is at node a or c, to which the halt was passed on\n");
  EXPECT_EQ(text_of(R"({"peers": [{"node": "a", "up": true}, {"node": "c", "up": false}]})"),
            "halt sent on 0 of 0 links\n"
            "  modem is at node a or c, not all of which are connected; its robots may not have "
            "been told\n");
}

TEST(HaltedLinks, AStandbyIsNotOneOnWhichItWasSent) {
  const std::string cluster = R"({"node": "b", "peers": [{"node": "a", "up": true}]})";
  const auto links_of = [&](const std::string& owner) {
    return LinksOf(
        (R"({"links": ["udp"], "down": [{"name": "radio-a", "state": "radio-a.pty; standby",
                        "role": "standby", "nodes": ["a", "b"], "owner": )" +
         owner + "}]}")
            .c_str(),
        cluster.c_str());
  };
  const HaltedLinks passed_on = links_of(R"("a")");
  EXPECT_EQ(passed_on.text,
            "halt sent on 1 of 1 link\n"
            "  radio-a is on standby for node a, to which the halt was passed on\n");
  EXPECT_TRUE(passed_on.all_told);
  for (const char* const owner : {"null", R"("b")"}) {
    const HaltedLinks untold = links_of(owner);
    EXPECT_EQ(untold.text,
              "halt sent on 1 of 1 link\n"
              "  radio-a is on standby, and no node sends there; its robots were not told\n");
    EXPECT_FALSE(untold.all_told);
  }
}

}  // namespace
}  // namespace pheromone::ctl
