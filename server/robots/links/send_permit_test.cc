#include "server/robots/links/send_permit.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>

namespace pheromone::links {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

uint64_t claim_now_ms = 0;

// 20 ms are for drivers.
TEST(SendPermit, WhatIsClaimedEndsBeforeThePermitOrIsNotBegun) {
  claim_now_ms = 1'000;
  SendPermit permit([] { return claim_now_ms; });
  EXPECT_FALSE(permit.Allows());
  EXPECT_FALSE(permit.Claim(milliseconds(1)));
  EXPECT_EQ(permit.in_use_until_ms(), 0u);
  permit.Set(1'100, "a");
  EXPECT_FALSE(permit.Claim(microseconds(80'001)));
  EXPECT_EQ(permit.in_use_until_ms(), 0u);
  EXPECT_TRUE(permit.Claim(milliseconds(80)));
  EXPECT_EQ(permit.in_use_until_ms(), 1'100u);
  EXPECT_TRUE(permit.Claim(milliseconds(10)));
  EXPECT_EQ(permit.in_use_until_ms(), 1'100u);
  claim_now_ms = 1'080;
  EXPECT_TRUE(permit.Allows());
  claim_now_ms = 1'081;
  EXPECT_FALSE(permit.Allows());
  permit.Set(0, "b");
  EXPECT_EQ(permit.in_use_until_ms(), 1'100u);
}

TEST(SendPermit, WhatIsHeldIsInUseUntilItIsReleased) {
  claim_now_ms = 1'000;
  SendPermit permit([] { return claim_now_ms; });
  permit.Set(1'100, "a");
  permit.Hold();
  EXPECT_TRUE(permit.Claim(milliseconds(10)));
  permit.Set(0, "a");
  claim_now_ms = 5'000;
  EXPECT_EQ(permit.in_use_until_ms(), UINT64_MAX);
  permit.Release();
  EXPECT_EQ(permit.in_use_until_ms(), 1'030u);
}

}  // namespace
}  // namespace pheromone::links
