#include "client_fw/sim/differential_drive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace pheromone::sim {
namespace {

constexpr double kPi = std::numbers::pi;

// No limits and no steps: closed forms hold to rounding.
DriveConfig Ideal() {
  DriveConfig config;
  config.wheelbase_m = 0.5;
  config.wheel_acceleration_m_s2 = 0;
  config.command_quantum_mm_s = 0;
  return config;
}

void Roll(DifferentialDrive* drive, int ms) {
  for (int i = 0; i < ms; ++i) {
    drive->Advance(0.001);
  }
}

TEST(MoveOnArcTest, StraightOn) {
  const PlanePose pose = MoveOnArc({1, 2, kPi / 2}, 0.3, 0.3, 0.5);
  EXPECT_NEAR(1, pose.x_m, 1e-15);
  EXPECT_NEAR(2.3, pose.y_m, 1e-15);
  EXPECT_EQ(kPi / 2, pose.heading_rad);
}

TEST(MoveOnArcTest, QuarterCircleToTheLeft) {
  // Radius 1 m, wheelbase 0.5 m: wheels on 0.75 and 1.25 m.
  const PlanePose pose = MoveOnArc({0, 0, 0}, 0.75 * kPi / 2, 1.25 * kPi / 2, 0.5);
  EXPECT_NEAR(1, pose.x_m, 1e-14);
  EXPECT_NEAR(1, pose.y_m, 1e-14);
  EXPECT_NEAR(kPi / 2, pose.heading_rad, 1e-14);
}

TEST(MoveOnArcTest, TurnOnTheSpot) {
  const PlanePose pose = MoveOnArc({3, 4, 0}, -0.25 * kPi, 0.25 * kPi, 0.5);
  EXPECT_NEAR(3, pose.x_m, 1e-14);
  EXPECT_NEAR(4, pose.y_m, 1e-14);
  EXPECT_NEAR(kPi, pose.heading_rad, 1e-14);
}

TEST(MoveOnArcTest, ManyStepsEqualOneArc) {
  const PlanePose once = MoveOnArc({0, 0, 0.3}, 2.0, 2.4, 0.5);
  PlanePose steps = {0, 0, 0.3};
  for (int i = 0; i < 1000; ++i) {
    steps = MoveOnArc(steps, 0.002, 0.0024, 0.5);
  }
  EXPECT_NEAR(once.x_m, steps.x_m, 1e-12);
  EXPECT_NEAR(once.y_m, steps.y_m, 1e-12);
  EXPECT_NEAR(once.heading_rad, steps.heading_rad, 1e-12);
}

TEST(DifferentialDriveTest, FasterRightWheelTurnsLeft) {
  DifferentialDrive drive(Ideal(), {0, 0, 0});
  drive.set_wheel_speeds(150, 250);
  Roll(&drive, 5000);
  // v = 0.2 m/s, w = 0.2 rad/s: radius 1 m, one radian in 5 s.
  EXPECT_NEAR(std::sin(1), drive.true_pose().x_m, 1e-12);
  EXPECT_NEAR(1 - std::cos(1), drive.true_pose().y_m, 1e-12);
  EXPECT_NEAR(1, drive.true_pose().heading_rad, 1e-12);
  EXPECT_NEAR(1, drive.travelled_m(), 1e-12);
}

TEST(DifferentialDriveTest, WheelsReachTheirSpeedAtTheLimit) {
  DriveConfig config = Ideal();
  config.wheel_acceleration_m_s2 = 0.3;
  DifferentialDrive drive(config, {0, 0, 0});
  drive.set_wheel_speeds(600, 600);
  Roll(&drive, 1000);
  EXPECT_NEAR(0.3, drive.left_m_s(), 1e-12);
  EXPECT_NEAR(0.3 / 2, drive.true_pose().x_m, 1e-12);  // a t^2 / 2
  Roll(&drive, 2000);
  EXPECT_EQ(0.6, drive.left_m_s());
  EXPECT_NEAR(0.6 * 0.6 / (2 * 0.3) + 0.6 * 1, drive.true_pose().x_m, 1e-12);
}

TEST(DifferentialDriveTest, WayDoesNotDependOnTheStep) {
  DriveConfig config = Ideal();
  config.wheel_acceleration_m_s2 = 0.3;
  DifferentialDrive fine(config, {0, 0, 0});
  DifferentialDrive coarse(config, {0, 0, 0});
  for (DifferentialDrive* drive : {&fine, &coarse}) {
    drive->set_wheel_speeds(500, 500);
  }
  Roll(&fine, 2500);
  coarse.Advance(2.5);  // the limit ends within the step
  EXPECT_NEAR(fine.true_pose().x_m, coarse.true_pose().x_m, 1e-12);
}

TEST(DifferentialDriveTest, BrakesAtTheLimitToo) {
  DriveConfig config = Ideal();
  config.wheel_acceleration_m_s2 = 0.5;
  DifferentialDrive drive(config, {0, 0, 0});
  drive.set_wheel_speeds(500, 500);
  Roll(&drive, 1000);
  drive.set_wheel_speeds(0, 0);
  Roll(&drive, 2000);
  EXPECT_EQ(0, drive.left_m_s());
  EXPECT_NEAR(2 * 0.5 * 0.5 / (2 * 0.5), drive.true_pose().x_m, 1e-12);
}

TEST(DifferentialDriveTest, CommandsAreInStepsOf20) {
  DriveConfig config;
  DifferentialDrive drive(config, {0, 0, 0});
  drive.set_wheel_speeds(209, 211);
  EXPECT_DOUBLE_EQ(0.200, drive.left_target_m_s());
  EXPECT_DOUBLE_EQ(0.220, drive.right_target_m_s());
  drive.set_wheel_speeds(-209, -211);
  EXPECT_DOUBLE_EQ(-0.200, drive.left_target_m_s());
  EXPECT_DOUBLE_EQ(-0.220, drive.right_target_m_s());
}

TEST(DifferentialDriveTest, SpeedIsLimited) {
  DriveConfig config;
  config.max_wheel_speed_m_s = 1.2;
  DifferentialDrive drive(config, {0, 0, 0});
  drive.set_wheel_speeds(2200, -2200);
  EXPECT_EQ(1.2, drive.left_target_m_s());
  EXPECT_EQ(-1.2, drive.right_target_m_s());
}

TEST(OdometryTest, BeginsAtZeroWhereverTheRobotStands) {
  DifferentialDrive drive(Ideal(), {5, -3, 1});
  client::Odometry odometry;
  ASSERT_TRUE(drive.odometry(&odometry));
  EXPECT_EQ(0, odometry.x_mm);
  EXPECT_EQ(0, odometry.y_mm);
  EXPECT_EQ(0, odometry.heading);
  drive.set_wheel_speeds(500, 500);
  Roll(&drive, 1000);
  drive.odometry(&odometry);
  EXPECT_EQ(500, odometry.x_mm);
  EXPECT_EQ(0, odometry.y_mm);
}

TEST(OdometryTest, HeadingIsIn4096ATurn) {
  DifferentialDrive drive(Ideal(), {0, 0, 0});
  drive.set_wheel_speeds(-100, 100);  // 0.4 rad/s
  client::Odometry odometry;
  for (int ms = 0; ms < 20000; ms += 100) {
    drive.odometry(&odometry);
    const double turns = 0.4 * ms / 1000 / (2 * kPi);
    EXPECT_EQ(static_cast<uint16_t>(std::llround(turns * 4096) * 16), odometry.heading) << ms;
    EXPECT_EQ(0, odometry.heading % 16);
    Roll(&drive, 100);
  }
}

TEST(OdometryTest, DriftIsOfTheOdometryAlone) {
  DriveConfig config = Ideal();
  config.right_scale = 1.01;
  DifferentialDrive drive(config, {0, 0, 0});
  drive.set_wheel_speeds(500, 500);
  Roll(&drive, 2000);
  EXPECT_NEAR(1, drive.true_pose().x_m, 1e-12);
  EXPECT_EQ(0, drive.true_pose().heading_rad);
  client::Odometry odometry;
  drive.odometry(&odometry);
  // 1 % of a metre over a wheelbase of half a metre: 0.02 rad, in 4096 a turn.
  EXPECT_EQ(std::llround(0.02 / (2 * kPi) * 4096) * 16, odometry.heading);
}

// At 0.5 m/s and 1 ms a step, so half a millimetre before the wall at the most.
TEST(DifferentialDriveTest, DoesNotEnterAnObstacle) {
  DriveConfig config = Ideal();
  config.blocked = [](const PlanePose& pose) { return pose.x_m > 0.25; };
  DifferentialDrive drive(config, {});
  drive.set_wheel_speeds(500, 500);
  Roll(&drive, 400);
  EXPECT_FALSE(drive.stalled());
  Roll(&drive, 600);
  EXPECT_TRUE(drive.stalled());
  EXPECT_LE(drive.true_pose().x_m, 0.25);
  EXPECT_GT(drive.true_pose().x_m, 0.2494);
  EXPECT_EQ(0, drive.left_m_s());
  client::Odometry odometry{};
  ASSERT_TRUE(drive.odometry(&odometry));
  EXPECT_NEAR(250, odometry.x_mm, 1);  // wheels that stall do not count
}

TEST(DifferentialDriveTest, TurnsOnTheSpotBesideAnObstacleAndLeavesIt) {
  DriveConfig config = Ideal();
  config.blocked = [](const PlanePose& pose) { return pose.x_m > 0.25; };
  DifferentialDrive drive(config, {});
  drive.set_wheel_speeds(500, 500);
  Roll(&drive, 1000);
  ASSERT_TRUE(drive.stalled());
  drive.set_wheel_speeds(-100, 100);
  Roll(&drive, 10);
  EXPECT_FALSE(drive.stalled());
  EXPECT_GT(drive.true_pose().heading_rad, 0);
  drive.set_wheel_speeds(-500, -500);
  Roll(&drive, 100);
  EXPECT_FALSE(drive.stalled());
  EXPECT_LT(drive.true_pose().x_m, 0.21);
}

}  // namespace
}  // namespace pheromone::sim
