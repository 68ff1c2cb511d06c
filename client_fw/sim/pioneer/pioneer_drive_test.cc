#include "client_fw/sim/pioneer/pioneer_drive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace pheromone::sim {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr PioneerBody kBody = {0.4, 0.4, 1.2};
constexpr MotionLimits kLimits = {1.0, 2.0, 0.3, 0.5, 1.0, 1.5};
constexpr MotionLimits kAtOnce = {10, 10, 1e9, 1e9, 1e9, 1e9};

PioneerDrive Perfect(const PlanePose& start = {}) {
  return {kBody, {}, start, {}};
}

void Roll(PioneerDrive* drive, const Motion& target, const MotionLimits& limits, int ms) {
  for (int i = 0; i < ms; ++i) {
    drive->Tick(target, limits);
  }
}

double LengthOf(const PlanePose& pose) {
  return std::hypot(pose.x_m, pose.y_m);
}

TEST(PioneerDriveTest, SpeedsUpAndSlowsDownAtTheirOwnRates) {
  PioneerDrive drive = Perfect();
  Roll(&drive, {0.6, 0}, kLimits, 1000);
  EXPECT_NEAR(drive.motion().speed_m_s, 0.3, 1e-9);
  EXPECT_NEAR(drive.true_pose().x_m, 0.3 / 2, 1e-9);  // a t^2 / 2
  Roll(&drive, {0.6, 0}, kLimits, 2000);
  EXPECT_EQ(drive.motion().speed_m_s, 0.6);
  Roll(&drive, {}, kLimits, 1000);
  EXPECT_NEAR(drive.motion().speed_m_s, 0.1, 1e-9);
  Roll(&drive, {0, 1.2}, kLimits, 1000);
  EXPECT_EQ(drive.motion().speed_m_s, 0);
  EXPECT_NEAR(drive.motion().turn_rad_s, 1.0, 1e-9);
  Roll(&drive, {}, kLimits, 500);
  EXPECT_NEAR(drive.motion().turn_rad_s, 0.25, 1e-9);
}

TEST(PioneerDriveTest, ReversesThroughAStand) {
  PioneerDrive drive = Perfect();
  Roll(&drive, {0.5, 0}, kLimits, 2000);
  Roll(&drive, {-0.3, 0}, kLimits, 1000);  // at 0.5 down to 0,
  EXPECT_NEAR(drive.motion().speed_m_s, 0, 1e-9);
  Roll(&drive, {-0.3, 0}, kLimits, 500);  // at 0.3 from there
  EXPECT_NEAR(drive.motion().speed_m_s, -0.15, 1e-3);
}

TEST(PioneerDriveTest, ACircleIsACircle) {
  PioneerDrive drive = Perfect({1, 2, kPi / 2});
  drive.Tick({0.5, 0.5}, kAtOnce);
  PioneerDrive fresh = drive;
  Roll(&drive, {0.5, 0.5}, kAtOnce, static_cast<int>(std::lround(kPi / 2 / 0.5 * 1000)));
  // A quarter of a turn to the left on a radius of 1 m.
  const PlanePose from = fresh.true_pose();
  EXPECT_NEAR(drive.true_pose().x_m - from.x_m, -1, 1e-3);
  EXPECT_NEAR(drive.true_pose().y_m - from.y_m, 1, 1e-3);
  EXPECT_NEAR(drive.true_pose().heading_rad - from.heading_rad, kPi / 2, 1e-3);
  EXPECT_NEAR(drive.left_m_s(), 0.5 - 0.5 * 0.2, 1e-12);
  EXPECT_NEAR(drive.right_m_s(), 0.5 + 0.5 * 0.2, 1e-12);
}

TEST(PioneerDriveTest, HaltStandsAtOnce) {
  PioneerDrive drive = Perfect();
  Roll(&drive, {0.5, 1}, kLimits, 1000);
  const PlanePose pose = drive.true_pose();
  drive.Halt();
  Roll(&drive, {}, kLimits, 100);
  EXPECT_EQ(drive.true_pose().x_m, pose.x_m);
  EXPECT_EQ(drive.true_pose().heading_rad, pose.heading_rad);
}

TEST(PioneerDriveTest, AWheelThatIsTooFastSlowsTheWholeCurveDown) {
  PioneerDrive drive = Perfect();
  const Motion wanted = {1.0, 2.0};  // a wheel at 1.4 m/s
  Roll(&drive, wanted, kLimits, 10'000);
  EXPECT_NEAR(drive.right_m_s(), 1.2, 1e-9);
  EXPECT_NEAR(drive.motion().speed_m_s / drive.motion().turn_rad_s, 0.5, 1e-9);
}

// The bounds that everything else relies on, whatever is commanded.
TEST(PioneerDriveTest, LimitsHoldForAnyCommands) {
  std::mt19937 random(7);
  const auto uniform = [&](double most) {
    return (static_cast<double>(random()) / 0x1p31 - 1) * most;
  };
  PioneerDrive drive = Perfect();
  double fastest_wheel = 0;
  for (int command = 0; command < 500; ++command) {
    const Motion target = {uniform(2), uniform(8)};
    const MotionLimits limits = {1.1, 5.0, 0.3 + std::abs(uniform(1)), 0.5, 1.0, 9.0};
    const auto duration_ms = static_cast<int>(random() % 5000);
    for (int ms = 0; ms < duration_ms; ++ms) {
      const Motion before = drive.motion();
      drive.Tick(target, limits);
      const Motion& after = drive.motion();
      const bool faster = std::abs(after.speed_m_s) > std::abs(before.speed_m_s);
      const bool turns_faster = std::abs(after.turn_rad_s) > std::abs(before.turn_rad_s);
      ASSERT_LE(std::abs(after.speed_m_s - before.speed_m_s),
                (faster ? limits.acceleration_m_s2 : 0.5) * 0.001 + 1e-12);
      ASSERT_LE(std::abs(after.turn_rad_s - before.turn_rad_s),
                (turns_faster ? 1.0 : 9.0) * 0.001 + 1e-12);
      ASSERT_LE(std::abs(after.speed_m_s), 1.1 + 1e-12);
      ASSERT_LE(std::abs(after.turn_rad_s), 5.0 + 1e-12);
      const double wheel = std::max(std::abs(drive.left_m_s()), std::abs(drive.right_m_s()));
      ASSERT_LE(wheel, 1.2 + 1e-8);
      fastest_wheel = std::max(fastest_wheel, wheel);
    }
  }
  EXPECT_GT(fastest_wheel, 1.19);  // the limit was tried
}

TEST(PioneerDriveTest, EveryAdmissibleMotionIsReached) {
  PioneerDrive drive = Perfect();
  const Motion corners[] = {{1.0, 1.0},   {0, 5.9},    {-1.0, 1.0},
                            {-1.0, -1.0}, {0.1, -5.5}, {1.19, 0}};
  const MotionLimits limits = {2, 8, 0.3, 0.3, 6, 6};
  for (const Motion& from : corners) {
    for (const Motion& to : corners) {
      Roll(&drive, from, limits, 20'000);
      Roll(&drive, to, limits, 20'000);
      EXPECT_NEAR(drive.motion().speed_m_s, to.speed_m_s, 1e-9);
      EXPECT_NEAR(drive.motion().turn_rad_s, to.turn_rad_s, 1e-9);
    }
  }
}

void DriveAbout(PioneerDrive* drive) {
  for (int leg = 0; leg < 20; ++leg) {
    Roll(drive, {0.1 * leg - 0.8, leg % 3 - 1.0}, kLimits, 1000);
  }
}

TEST(OdometryErrorsTest, WithoutThemOdometryIsTheTruth) {
  PioneerDrive drive = Perfect();
  DriveAbout(&drive);
  EXPECT_NEAR(drive.odometry().x_m, drive.true_pose().x_m, 1e-12);
  EXPECT_NEAR(drive.odometry().y_m, drive.true_pose().y_m, 1e-12);
  EXPECT_NEAR(drive.odometry().heading_rad, drive.true_pose().heading_rad, 1e-12);
  drive.ResetOdometry();
  EXPECT_EQ(LengthOf(drive.odometry()), 0);
  EXPECT_NE(LengthOf(drive.true_pose()), 0);
}

TEST(OdometryErrorsTest, ScaleIsMetresSeenAMetreDriven) {
  PioneerErrors errors;
  errors.scale = 0.02;
  PioneerDrive drive(kBody, errors, {}, {});
  Roll(&drive, {0.5, 0}, kLimits, 10'000);
  EXPECT_NEAR(drive.odometry().x_m / drive.true_pose().x_m, 1.02, 1e-12);
  EXPECT_EQ(drive.true_pose().heading_rad, 0);
}

TEST(OdometryErrorsTest, HeadingDriftsByTheWay) {
  PioneerErrors errors;
  errors.heading_rad_per_m = 0.01;
  PioneerDrive drive(kBody, errors, {}, {});
  Roll(&drive, {0.5, 0}, kLimits, 10'000);
  // The firmware holds its own heading at 0; it is the robot that turns away.
  EXPECT_NEAR(drive.odometry().heading_rad, 0, 1e-12);
  EXPECT_NEAR(drive.odometry().heading_rad - drive.true_pose().heading_rad,
              0.01 * drive.odometry().x_m, 1e-4);
}

TEST(OdometryErrorsTest, AnotherWheelbaseTurnsTheRobotOtherwise) {
  PioneerDrive drive({0.33, 0.357, 1.2}, {}, {}, {});
  Roll(&drive, {0, 1}, kLimits, 5000);
  EXPECT_NEAR(drive.true_pose().heading_rad / drive.odometry().heading_rad, 0.357 / 0.33, 1e-12);
}

TEST(OdometryErrorsTest, SlipLosesAtMostItsShareAndAHalfOfItOnAverage) {
  PioneerErrors errors;
  errors.slip = 0.2;
  PioneerDrive drive(kBody, errors, {}, {});
  Roll(&drive, {0.5, 0}, kLimits, 1000);
  for (int i = 0; i < 1000; ++i) {
    const PlanePose before = drive.true_pose();
    const double seen = drive.odometry().x_m;
    Roll(&drive, {0.5, 0}, kLimits, 100);
    const double way =
        std::hypot(drive.true_pose().x_m - before.x_m, drive.true_pose().y_m - before.y_m);
    ASSERT_LE(way, (drive.odometry().x_m - seen) * (1 + 1e-9));
    ASSERT_GE(way, (drive.odometry().x_m - seen) * 0.799);
  }
  // Of 1000 intervals and two wheels, the mean loss is within 5 standard deviations of 0.1.
  PioneerDrive straight({1e6, 0.4, 1.2}, errors, {}, {});  // too wide to be turned by slip
  Roll(&straight, {0.5, 0}, kAtOnce, 100'000);
  EXPECT_NEAR(straight.true_pose().x_m / straight.odometry().x_m, 0.9,
              5 * 0.2 / std::sqrt(12 * 2000.0));
}

TEST(OdometryErrorsTest, AreRepeatableBySeedAndDifferByIt) {
  PioneerErrors most;
  most.scale = 0.02;
  most.heading_rad_per_m = 0.01;
  most.slip = 0.1;
  const auto end = [&](uint64_t seed) {
    PioneerDrive drive(kBody, DrawPioneerErrors(most, seed), {}, {});
    DriveAbout(&drive);
    return drive.true_pose();
  };
  EXPECT_EQ(end(1).x_m, end(1).x_m);
  EXPECT_NE(end(1).x_m, end(2).x_m);
}

TEST(OdometryErrorsTest, DrawnOnesStayWithinTheirBounds) {
  PioneerErrors most;
  most.scale = 0.02;
  most.heading_rad_per_m = 0.01;
  double least_scale = 1;
  double most_scale = -1;
  for (uint64_t seed = 0; seed < 1000; ++seed) {
    const PioneerErrors errors = DrawPioneerErrors(most, seed);
    ASSERT_LE(std::abs(errors.scale), 0.02);
    ASSERT_LE(std::abs(errors.heading_rad_per_m), 0.01);
    least_scale = std::min(least_scale, errors.scale);
    most_scale = std::max(most_scale, errors.scale);
  }
  EXPECT_LT(least_scale, -0.018);
  EXPECT_GT(most_scale, 0.018);
}

TEST(ObstacleTest, ARobotStandsBeforeItStallsAndTurnsAway) {
  const auto wall = [](const PlanePose& pose) { return pose.x_m > 0.5; };
  PioneerDrive drive(kBody, {}, {}, wall);
  Roll(&drive, {0.4, 0}, kLimits, 5000);
  EXPECT_GT(drive.true_pose().x_m, 0.499);
  EXPECT_LE(drive.true_pose().x_m, 0.5);
  EXPECT_NEAR(drive.odometry().x_m, drive.true_pose().x_m, 1e-12);
  EXPECT_EQ(drive.motion(), Motion{});
  EXPECT_TRUE(drive.left_stalled());
  EXPECT_TRUE(drive.right_stalled());

  Roll(&drive, {0, 1}, kLimits, 1000);  // on the spot nothing is in its way
  EXPECT_FALSE(drive.left_stalled());
  EXPECT_GT(drive.true_pose().heading_rad, 0.4);
  Roll(&drive, {-0.2, 0}, kLimits, 1000);
  EXPECT_LT(drive.true_pose().x_m, 0.5);
  EXPECT_FALSE(drive.right_stalled());
}

TEST(ObstacleTest, WithoutACommandNothingStalls) {
  PioneerDrive drive(kBody, {}, {}, [](const PlanePose&) { return true; });
  Roll(&drive, {}, kLimits, 10);
  EXPECT_FALSE(drive.left_stalled());
  Roll(&drive, {0.4, 0}, kLimits, 10);
  EXPECT_TRUE(drive.left_stalled());
  Roll(&drive, {}, kLimits, 1);
  EXPECT_FALSE(drive.left_stalled());
}

}  // namespace
}  // namespace pheromone::sim
