#include "client_fw/core/tasks/go_to.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace pheromone {
namespace client {
namespace {

TEST(GoToTest, AheadIsStraightOnAndBehindTurnsOnTheSpot) {
  EXPECT_EQ((WheelSpeeds{200, 200}), SteerTo(1000, 0, 0, 200));
  EXPECT_EQ((WheelSpeeds{200, 200}), SteerTo(0, -1000, 3 * kQuarterTurn, 200));
  EXPECT_EQ((WheelSpeeds{-100, 100}), SteerTo(0, 1000, 0, 200)) << "to the left";
  EXPECT_EQ((WheelSpeeds{100, -100}), SteerTo(0, -1000, 0, 200)) << "to the right";
  EXPECT_EQ((WheelSpeeds{-100, 100}), SteerTo(-1000, 0, 0, 200));
}

TEST(GoToTest, FarPointsDoNotOverflow) {
  const WheelSpeeds far = SteerTo(INT16_MAX, INT16_MAX, 0x2000, 1000);
  EXPECT_EQ(1000, far.left_mm_s);
  EXPECT_EQ(1000, far.right_mm_s);
  EXPECT_EQ((WheelSpeeds{-500, 500}), SteerTo(-INT16_MAX, INT16_MAX, 0, 1000));
}

// A robot with 330 mm between its wheels, advanced in floating point.
TEST(GoToTest, ARobotArrivesFromEveryHeading) {
  for (int degrees = 0; degrees < 360; degrees += 15) {
    double x = 0;
    double y = 0;
    double heading = degrees * std::numbers::pi / 180;
    int ms = 0;
    while (std::hypot(1500 - x, -900 - y) > 20 && ms < 20'000) {
      const auto angle =
          static_cast<BinaryAngle>(std::lround(heading * 65536 / (2 * std::numbers::pi)) & 0xFFFF);
      const WheelSpeeds wheels = SteerTo(static_cast<int16_t>(std::lround(1500 - x)),
                                         static_cast<int16_t>(std::lround(-900 - y)), angle, 200);
      const double v = (wheels.left_mm_s + wheels.right_mm_s) / 2.0;
      heading += (wheels.right_mm_s - wheels.left_mm_s) / 330.0 / 1000;
      x += v * std::cos(heading) / 1000;
      y += v * std::sin(heading) / 1000;
      ++ms;
    }
    // Straight it takes 8.7 s; half a turn on the spot 5.2 s.
    EXPECT_LT(ms, 15'000) << degrees;
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
