#include "server/operators/ctl/cluster/cluster_check.h"

#include <gtest/gtest.h>

namespace pheromone::ctl {
namespace {

TEST(ClusterCheck, MostMembersSayOfWhichClusterEtcdIsAndNotTheFirst) {
  EXPECT_EQ(ClusterOfMost({"7", "3", "3"}, 3), "3");
  EXPECT_EQ(ClusterOfMost({"3", "7", "3"}, 3), "3");
  EXPECT_EQ(ClusterOfMost({"7", "3", "3", "3"}, 5), "3");
}

TEST(ClusterCheck, MembersThatAgreeAreOfOneClusterHoweverFewAnswer) {
  EXPECT_EQ(ClusterOfMost({"3"}, 3), "3");
  EXPECT_EQ(ClusterOfMost({"3", "3"}, 5), "3");
}

TEST(ClusterCheck, WithoutAMajorityNoMemberIsBlamed) {
  EXPECT_EQ(ClusterOfMost({"7", "3"}, 3), "");
  EXPECT_EQ(ClusterOfMost({"7", "3", "5"}, 3), "");
  EXPECT_EQ(ClusterOfMost({}, 3), "");
}

TEST(ClusterCheck, MembersThatDoNotAnswerMayBeTheMajority) {
  EXPECT_EQ(ClusterOfMost({"7", "3", "3"}, 5), "");
}

}  // namespace
}  // namespace pheromone::ctl
