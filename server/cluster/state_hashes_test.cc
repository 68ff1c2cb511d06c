#include "server/cluster/state_hashes.h"

#include <gtest/gtest.h>

namespace pheromone::cluster {
namespace {

TEST(StateHashes, ADifferenceIsFoundWhicheverHashComesFirst) {
  StateHashes hashes;
  hashes.Hear("b", 10, 1);
  EXPECT_EQ(hashes.Difference("b"), std::nullopt);
  hashes.Note(10, 1);
  EXPECT_EQ(hashes.Difference("b"), std::nullopt);
  hashes.Note(20, 2);
  hashes.Hear("b", 20, 3);
  EXPECT_EQ(hashes.Difference("b"), 20u);
  EXPECT_EQ(hashes.Difference("b"), std::nullopt) << "once";
  hashes.Hear("b", 20, 3);
  EXPECT_EQ(hashes.Difference("b"), std::nullopt) << "it is told until there is a newer one";
  hashes.Hear("b", 30, 3);
  hashes.Note(30, 4);
  EXPECT_EQ(hashes.Difference("b"), 30u);
}

TEST(StateHashes, OnlyHashesAfterTheSameEventAreCompared) {
  StateHashes hashes;
  hashes.Note(10, 1);
  hashes.Hear("b", 11, 2);
  hashes.Hear("c", 10, 2);
  EXPECT_EQ(hashes.Difference("b"), std::nullopt);
  EXPECT_EQ(hashes.Difference("c"), 10u);
  hashes.Note(11, 3);
  hashes.Forget("b");
  EXPECT_EQ(hashes.Difference("b"), std::nullopt);
}

TEST(StateHashes, TheNewestUpToAnEventIsTheOneToTell) {
  StateHashes hashes;
  EXPECT_EQ(hashes.Newest(100), nullptr);
  for (uint64_t i = 1; i <= 100; ++i) {
    hashes.Note(10 * i, i);
  }
  EXPECT_EQ(hashes.Newest(999)->first, 990u);
  EXPECT_EQ(hashes.Newest(999)->second, 99u);
  EXPECT_EQ(hashes.Newest(10 * (100 - StateHashes::kMaxHashes)), nullptr) << "forgotten";
}

}  // namespace
}  // namespace pheromone::cluster
