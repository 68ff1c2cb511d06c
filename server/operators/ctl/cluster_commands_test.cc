#include "server/operators/ctl/cluster_commands.h"

#include <gtest/gtest.h>

#include <string>

#include <boost/json/object.hpp>

namespace pheromone::ctl {
namespace {

boost::json::object Follower() {
  return {{"name", "lab"},  {"node", "b"},       {"role", "follows"},        {"leader", "a"},
          {"term", 7},      {"elections", 2},    {"committed_sequence", 41}, {"behind", 1},
          {"heard_s", 0.0}, {"trouble", nullptr}};
}

TEST(ClusterStatus, AServerThatIsWellHasNoWarning) {
  const std::string text = DescribeCluster(Follower());
  EXPECT_EQ(text.find("cluster   lab, node b: follows\n"
                      "leader    a, term 7; 2 changes of the leader seen\n"
                      "log       event 41 is committed, 1 to be applied here; heard "),
            0u)
      << text;
  EXPECT_EQ(text.find("WARNING"), std::string::npos) << text;
}

TEST(ClusterStatus, WhatIsWrongWithTheLogAndWhyItCannotFollowAreWarnings) {
  boost::json::object cluster = Follower();
  cluster["gap"] = nullptr;
  EXPECT_EQ(DescribeCluster(cluster), DescribeCluster(Follower()));
  cluster["gap"] = "the log begins at event 90";
  EXPECT_EQ(DescribeCluster(cluster),
            DescribeCluster(Follower()) + "WARNING   the log begins at event 90\n");
  cluster["trouble"] = "no majority";
  EXPECT_EQ(DescribeCluster(cluster), DescribeCluster(Follower()) +
                                          "WARNING   no majority\n"
                                          "WARNING   the log begins at event 90\n");
}

}  // namespace
}  // namespace pheromone::ctl
