#include "server/cluster/state_hashes.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace pheromone::cluster {
namespace {

constexpr uint64_t kAll = UINT64_MAX;

TEST(StateHashes, ADifferenceIsFoundWhicheverHashComesFirst) {
  StateHashes hashes;
  hashes.Hear("b", 10, 1);
  EXPECT_EQ(hashes.Difference("b", kAll), std::nullopt);
  hashes.Note(10, 1);
  EXPECT_EQ(hashes.Difference("b", kAll), std::nullopt);
  hashes.Note(20, 2);
  hashes.Hear("b", 20, 3);
  EXPECT_EQ(hashes.Difference("b", kAll), 20u);
  EXPECT_EQ(hashes.Difference("b", kAll), std::nullopt) << "once";
  hashes.Hear("b", 20, 3);
  EXPECT_EQ(hashes.Difference("b", kAll), std::nullopt) << "it is told until there is a newer one";
  hashes.Hear("b", 30, 3);
  hashes.Note(30, 4);
  EXPECT_EQ(hashes.Difference("b", kAll), 30u);
}

TEST(StateHashes, WhatIsNotCommittedHereIsComparedWhenItIs) {
  StateHashes hashes;
  hashes.Note(10, 1);
  hashes.Hear("b", 10, 2);
  EXPECT_EQ(hashes.Difference("b", 9), std::nullopt);
  EXPECT_EQ(hashes.Difference("b", 10), 10u);
}

TEST(StateHashes, OnlyHashesAfterTheSameEventAreCompared) {
  StateHashes hashes;
  hashes.Note(10, 1);
  hashes.Hear("b", 11, 2);
  hashes.Hear("c", 10, 2);
  EXPECT_EQ(hashes.Difference("b", kAll), std::nullopt);
  EXPECT_EQ(hashes.Difference("c", kAll), 10u);
  hashes.Note(11, 3);
  hashes.Forget("b");
  EXPECT_EQ(hashes.Difference("b", kAll), std::nullopt);
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
