#include "client_fw/swarm/fit.h"

#include <gtest/gtest.h>

namespace pheromone::swarm {
namespace {

SpeedFit Fit(int16_t speed_mm_s) {
  return {.speed_mm_s = speed_mm_s,
          .period_ms = 200,
          .reach_m = 0.5,
          .drive = LimitsOf(*sim::FindPioneerModel("p3dx-sh"))};
}

// By hand, with a = 0.3 m/s2: 0.6 * 0.35 + 0.36 / 0.6 = 0.81 m.
TEST(SpeedFit, SaysHowFarARobotGoesWhoseTrailEnds) {
  const auto warning = SpeedWarning(Fit(600));
  ASSERT_TRUE(warning.has_value());
  EXPECT_NE(warning->find("at 0.6 m/s the robot needs 0.81 m"), std::string::npos) << *warning;
  EXPECT_NE(warning->find("within 0.5 m"), std::string::npos) << *warning;
}

// K * 0.35 + K^2 / 0.6 at 450 and 460 mm/s: 0.495 and 0.514 m.
TEST(SpeedFit, TheLargestSpeedStopsWithinReach) {
  EXPECT_EQ(450, FittingSpeed(Fit(600)));
  EXPECT_FALSE(SpeedWarning(Fit(450)).has_value());
  const auto warning = SpeedWarning(Fit(460));
  ASSERT_TRUE(warning.has_value());
  EXPECT_NE(warning->find("expected at most 0.45 m/s"), std::string::npos) << *warning;
}

// 100 degrees a second of 357 mm: 623 mm/s.
TEST(SpeedFit, SaysWhereTheRobotCannotTurnAsItSteers) {
  SpeedFit fit = Fit(700);
  fit.reach_m = 5;
  EXPECT_EQ(620, FittingSpeed(fit));
  const auto warning = SpeedWarning(fit);
  ASSERT_TRUE(warning.has_value());
  EXPECT_EQ(
      "turning about a wheel at 0.7 m/s takes 112 degrees/s, and the robot does 100; expected at "
      "most 0.62 m/s",
      *warning);
}

TEST(SpeedFit, ALongPeriodCountsToo) {
  SpeedFit fit = Fit(300);
  EXPECT_FALSE(SpeedWarning(fit).has_value());
  fit.period_ms = 2000;
  EXPECT_TRUE(SpeedWarning(fit).has_value());
}

TEST(SpeedFit, ADriveWithoutLimitsNeedsOnlyTheTimeToNotice) {
  SpeedFit fit = Fit(1000);
  fit.drive = {};
  EXPECT_EQ(1420, FittingSpeed(fit));  // 0.5 m in 0.35 s
  EXPECT_FALSE(SpeedWarning(fit).has_value());
}

}  // namespace
}  // namespace pheromone::swarm
