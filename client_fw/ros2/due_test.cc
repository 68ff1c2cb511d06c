#include "client_fw/ros2/due.h"

#include <gtest/gtest.h>

#include <vector>

namespace pheromone::ros2 {
namespace {

std::vector<int64_t> ClaimedOf(const std::vector<int64_t>& times_ms) {
  Due due(1000);
  std::vector<int64_t> claimed;
  for (const int64_t now_ms : times_ms) {
    if (due.Claim(now_ms)) {
      claimed.push_back(now_ms);
    }
  }
  return claimed;
}

TEST(Due, IsOnceInAPeriod) {
  EXPECT_EQ(ClaimedOf({0, 1, 999, 1000, 1001, 1999, 2000}), (std::vector<int64_t>{0, 1000, 2000}));
}

TEST(Due, BeingLateDoesNotShiftWhatFollows) {
  EXPECT_EQ(ClaimedOf({0, 1900, 1999, 2000, 3500, 3999, 4100}),
            (std::vector<int64_t>{0, 1900, 2000, 3500, 4100}));
}

TEST(Due, WhatWasMissedIsNotMadeUpFor) {
  EXPECT_EQ(ClaimedOf({0, 5500, 5501, 5999, 6000}), (std::vector<int64_t>{0, 5500, 6000}));
}

}  // namespace
}  // namespace pheromone::ros2
