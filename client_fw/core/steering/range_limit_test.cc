#include "client_fw/core/steering/range_limit.h"

#include <gtest/gtest.h>

#include "client_fw/core/steering/drive_status.h"

namespace pheromone {
namespace client {
namespace {

// v <= front - 250, the difference of the wheels as before.
TEST(RangeLimitTest, LimitsTheSpeedAheadAndLeavesTheTurnRate) {
  for (int left = -2200; left <= 2200; left += 275) {
    for (int right = -2200; right <= 2200; right += 275) {
      for (const int front : {0, 1, 249, 250, 251, 300, 900, 2449, 2450, 32767, 65534}) {
        const WheelSpeeds asked = {static_cast<int16_t>(left), static_cast<int16_t>(right)};
        const WheelSpeeds given = LimitByRange(asked, static_cast<uint16_t>(front));
        EXPECT_EQ(left - right, given.left_mm_s - given.right_mm_s);
        const int most = std::max(0, front - 250);
        const double asked_speed = (left + right) / 2.0;
        const double speed = (given.left_mm_s + given.right_mm_s) / 2.0;
        if (asked_speed <= most) {
          EXPECT_EQ(asked_speed, speed);
        } else {
          EXPECT_NEAR(most, speed, 0.5);
        }
      }
    }
  }
}

TEST(RangeLimitTest, WithoutARangeNothingChanges) {
  const WheelSpeeds asked = {2200, 2200};
  EXPECT_EQ(asked, LimitByRange(asked, kNoRange));
}

}  // namespace
}  // namespace client
}  // namespace pheromone
