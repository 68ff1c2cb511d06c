#include "client_fw/ros2/ros_robot.h"

#include <gtest/gtest.h>

#include <numbers>
#include <optional>
#include <vector>

namespace pheromone::ros2 {
namespace {

constexpr double kPi = std::numbers::pi;

client::Parameters Standing() {
  client::Parameters parameters;
  parameters.start = {5000, 3000, 0x4000};  // faces +y
  parameters.buffered_link = true;
  parameters.gap_timeout_ms = 0;
  parameters.rounds = false;
  return parameters;
}

// A robot, its odometry at 50 Hz, and no server.
struct World {
  explicit World(PoseSource source = PoseSource::kStart) : robot(Standing(), 0.16, source) {}

  // What was published meanwhile.
  std::vector<Speed> Run(int64_t ms, std::optional<PlanePose> odometry) {
    std::vector<Speed> speeds;
    for (const int64_t end = now_ms + ms; now_ms < end; ++now_ms) {
      if (odometry && now_ms % 20 == 0) {
        robot.OnOdometry(*odometry, now_ms);
      }
      robot.Step(now_ms);
      if (const auto speed = robot.ClaimSpeed()) {
        speeds.push_back(*speed);
      }
      if (!robot.ClaimFrame().empty()) {
        robot.OnFrameSent();
      }
    }
    return speeds;
  }

  RosRobot robot;
  int64_t now_ms = 20;
};

TEST(PlanePose, ComposeAndInverseAreThoseOfMatrices) {
  const PlanePose a{1, 2, kPi / 2};
  const PlanePose b{3, 1, kPi / 4};
  const PlanePose ab = Compose(a, b);
  EXPECT_NEAR(ab.x_m, 1 - 1, 1e-12);  // a turns (3, 1) into (-1, 3)
  EXPECT_NEAR(ab.y_m, 2 + 3, 1e-12);
  EXPECT_NEAR(ab.heading_rad, 3 * kPi / 4, 1e-12);
  const PlanePose one = Compose(Inverse(a), a);
  EXPECT_NEAR(one.x_m, 0, 1e-12);
  EXPECT_NEAR(one.y_m, 0, 1e-12);
  EXPECT_NEAR(one.heading_rad, 0, 1e-12);
}

TEST(RosRobot, PublishesNothingBeforeAResume) {
  World world;
  EXPECT_TRUE(world.Run(3000, PlanePose{}).empty());
  world.robot.Halt();
  EXPECT_TRUE(world.Run(3000, PlanePose{}).empty());
}

TEST(RosRobot, AfterAHaltItTellsZeroForASecondAndThenNothing) {
  World world;
  world.Run(100, PlanePose{});
  world.robot.Enable(true);
  EXPECT_FALSE(world.Run(1000, PlanePose{}).empty());
  world.robot.Enable(false);
  const std::vector<Speed> told = world.Run(kStandMs, PlanePose{});
  ASSERT_GE(told.size(), 4u);  // at once, and each 250 ms
  for (const Speed& speed : told) {
    EXPECT_EQ(speed.forward_m_s, 0);
    EXPECT_EQ(speed.turn_rad_s, 0);
  }
  EXPECT_TRUE(world.Run(3000, PlanePose{}).empty());
}

TEST(RosRobot, HaltHoldsUntilAResumeAndDisabledUntilEnabled) {
  World world;
  world.Run(100, PlanePose{});
  world.robot.Enable(true);
  world.Run(100, PlanePose{});
  EXPECT_TRUE(world.robot.released());
  world.robot.Halt();
  world.Run(100, PlanePose{});
  EXPECT_FALSE(world.robot.released());
  world.robot.Enable(true);
  world.Run(100, PlanePose{});
  EXPECT_TRUE(world.robot.released());
  world.robot.Enable(false);
  world.Run(100, PlanePose{});
  EXPECT_FALSE(world.robot.released());
  EXPECT_NE(world.robot.conversation().state().drive.alarms & client::kStopButtonAlarm, 0);
}

TEST(RosRobot, AHaltWinsOverAResumeOfTheSameTurn) {
  for (const bool halt_first : {true, false}) {
    World world;
    world.Run(100, PlanePose{});
    world.robot.Enable(true);
    world.Run(100, PlanePose{});
    EXPECT_TRUE(world.robot.released());
    if (halt_first) {
      world.robot.Halt();
      world.robot.Enable(true);
    } else {
      world.robot.Enable(true);
      world.robot.Halt();
    }
    world.Run(100, PlanePose{});
    EXPECT_FALSE(world.robot.released());
  }
}

TEST(RosRobot, StandsAtOnceWhenOdometryIsOld) {
  World world;
  world.Run(100, PlanePose{});
  world.robot.Enable(true);
  world.Run(100, PlanePose{});
  world.Run(kOdometryMs - 20, std::nullopt);
  EXPECT_TRUE(world.robot.has_odometry());
  const std::vector<Speed> told = world.Run(30, std::nullopt);
  EXPECT_FALSE(world.robot.has_odometry());
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told.back().forward_m_s, 0);
  world.Run(100, PlanePose{});
  EXPECT_TRUE(world.robot.has_odometry());
}

TEST(RosRobot, StartPoseIsWhereOdometryBegan) {
  World world;
  world.Run(100, PlanePose{10, 20, kPi / 2});
  for (const double turn : {0.25, 0.5, 0.75, 1.0}) {  // 0.25 m ahead, and a left turn
    world.Run(40, PlanePose{10, 20.25, (1 + turn) * kPi / 2});
  }
  EXPECT_EQ(world.robot.conversation().state().flags & client::kPoseLost, 0);
  const client::Pose pose = world.robot.pose();
  EXPECT_NEAR(pose.x_mm, 5000, 1);
  EXPECT_NEAR(pose.y_mm, 3250, 1);
  EXPECT_EQ(pose.heading, 0x8000);
}

TEST(RosRobot, OdometryThatJumpsLosesThePoseAndHalts) {
  World world;
  world.Run(100, PlanePose{4, 0, 0});
  world.robot.Enable(true);
  world.Run(100, PlanePose{4, 0, 0});
  EXPECT_TRUE(world.robot.released());
  world.Run(100, PlanePose{0, 0, 0});  // the base was restarted
  EXPECT_FALSE(world.robot.released());
  EXPECT_NE(world.robot.conversation().state().flags & client::kPoseLost, 0);
}

// A base that restarts takes half a minute, and begins at 0 again.
TEST(RosRobot, OdometryThatReturnsElsewhereLosesThePoseHoweverLongItWasAway) {
  for (const PlanePose& before : {PlanePose{4, 0, 0}, PlanePose{0, 0, 3}}) {
    for (const int64_t away_ms : {int64_t{0}, int64_t{500}, int64_t{30'000}}) {
      World world;
      world.Run(100, before);
      world.robot.Enable(true);
      world.Run(100, before);
      world.Run(away_ms, std::nullopt);
      world.Run(100, PlanePose{});
      EXPECT_FALSE(world.robot.released()) << away_ms;
      EXPECT_NE(world.robot.conversation().state().flags & client::kPoseLost, 0) << away_ms;
    }
  }
}

TEST(RosRobot, OdometryThatReturnsWhereItWasKeepsThePose) {
  World world;
  world.Run(100, PlanePose{4, 0, 3});
  world.robot.Enable(true);
  world.Run(100, PlanePose{4, 0, 3});
  world.Run(30'000, std::nullopt);
  world.Run(100, PlanePose{4.5, 0, -3});  // it coasted meanwhile
  EXPECT_TRUE(world.robot.released());
  EXPECT_EQ(world.robot.conversation().state().flags & client::kPoseLost, 0);
}

TEST(RosRobot, MapPoseIsTheTransformTimesOdometry) {
  World world(PoseSource::kMap);
  world.Run(100, PlanePose{1, 0, 0});
  EXPECT_TRUE(world.robot.has_odometry());
  EXPECT_FALSE(world.robot.has_place());
  world.robot.OnMapToOdometry({2, 3, kPi / 2});
  world.Run(40, PlanePose{1, 0, 0});
  const client::Pose pose = world.robot.pose();
  EXPECT_NEAR(pose.x_mm, 2000, 1);
  EXPECT_NEAR(pose.y_mm, 4000, 1);
  EXPECT_EQ(pose.heading, 0x4000);
}

}  // namespace
}  // namespace pheromone::ros2
