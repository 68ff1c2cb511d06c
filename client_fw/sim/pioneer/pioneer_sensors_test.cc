#include "client_fw/sim/pioneer/pioneer_sensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "client_fw/sim/testing/pioneer_client.h"

namespace pheromone::sim {
namespace {

using testing::Client;

constexpr double kDegree = std::numbers::pi / 180;

// A wall that is the half-plane x >= `wall_m`.
RangeFinder WallAt(double wall_m) {
  return [wall_m](const PlanePose& from, double /*reach_m*/) {
    const double ahead = std::cos(from.heading_rad);
    return ahead > 1e-9 ? (wall_m - from.x_m) / ahead : std::numeric_limits<double>::infinity();
  };
}

// A round post.
RangeFinder PostAt(double x_m, double y_m, double radius_m) {
  return [=](const PlanePose& from, double /*reach_m*/) {
    const double along = (x_m - from.x_m) * std::cos(from.heading_rad) +
                         (y_m - from.y_m) * std::sin(from.heading_rad);
    const double beside = (y_m - from.y_m) * std::cos(from.heading_rad) -
                          (x_m - from.x_m) * std::sin(from.heading_rad);
    const double square = radius_m * radius_m - beside * beside;
    return along > 0 && square >= 0 ? along - std::sqrt(square)
                                    : std::numeric_limits<double>::infinity();
  };
}

TEST(SonarTest, SeesAWallFromItsPlaceInItsDirection) {
  const PioneerModel& model = *FindPioneerModel("p3dx");
  // Two metres from the wall, facing it. Number 3: 166 mm ahead, 27 mm to the left, 10 degrees.
  const PlanePose robot{1, 5, 0};
  EXPECT_EQ(SonarRangeMm(model.sonars[3], robot, WallAt(3)),
            std::lround(1834 / std::cos(10 * kDegree)));
  EXPECT_EQ(SonarRangeMm(model.sonars[1], robot, WallAt(3)),
            std::lround(1886 / std::cos(50 * kDegree)));
  EXPECT_EQ(SonarRangeMm(model.sonars[0], robot, WallAt(3)), 5000);   // along the wall
  EXPECT_EQ(SonarRangeMm(model.sonars[11], robot, WallAt(3)), 5000);  // away from it
  // The wall on its left: the heading is 270 degrees, so left is +x.
  const PlanePose beside{1, 5, 1.5 * std::numbers::pi};
  EXPECT_EQ(SonarRangeMm(model.sonars[0], beside, WallAt(3)), 2000 - 136);
  EXPECT_EQ(SonarRangeMm(model.sonars[7], beside, WallAt(3)), 5000);
}

TEST(SonarTest, ReportsNothingNearerOrFartherThanItCan) {
  const SonarMount ahead{100, 0, 0};
  EXPECT_EQ(SonarRangeMm(ahead, {}, WallAt(6)), 5000);
  EXPECT_EQ(SonarRangeMm(ahead, {}, WallAt(5.05)), 4950);
  EXPECT_EQ(SonarRangeMm(ahead, {}, WallAt(0.15)), 100);
  EXPECT_EQ(SonarRangeMm(ahead, {}, {}), 5000);
}

// A post touches the rim at every degree: exactly the segment there is pressed, or two at a border.
TEST(BumperTest, TheSegmentThatIsTouchedIsPressed) {
  const PioneerModel& model = *FindPioneerModel("p3dx");
  const PlanePose robot{2, 3, 100 * kDegree};
  for (int clockwise_deg = 0; clockwise_deg < 360; ++clockwise_deg) {
    const double bearing = robot.heading_rad + (90 - clockwise_deg) * kDegree;
    const double at_m = 0.255 + 0.02;
    const PressedBumpers pressed = FindPressedBumpers(
        model, 5, robot,
        PostAt(robot.x_m + at_m * std::cos(bearing), robot.y_m + at_m * std::sin(bearing), 0.02));
    const int segment = clockwise_deg % 180 / 36;
    const auto bit = static_cast<uint8_t>(1 << segment);
    if (clockwise_deg % 36 < 4 || clockwise_deg % 36 > 32) {
      EXPECT_NE(pressed.front | pressed.rear, 0) << clockwise_deg;
    } else {
      EXPECT_EQ(pressed.front, clockwise_deg < 180 ? bit : 0) << clockwise_deg;
      EXPECT_EQ(pressed.rear, clockwise_deg < 180 ? 0 : bit) << clockwise_deg;
    }
  }
}

TEST(BumperTest, ArePressedWithinTheirTravelOnly) {
  const PioneerModel& model = *FindPioneerModel("amigo");
  EXPECT_EQ(FindPressedBumpers(model, 5, {}, WallAt(0.1899)).front, 0b00100);
  EXPECT_EQ(FindPressedBumpers(model, 5, {}, WallAt(0.1901)), PressedBumpers{});
  EXPECT_EQ(FindPressedBumpers(model, 0, {}, WallAt(0.18)), PressedBumpers{});
  EXPECT_EQ(FindPressedBumpers(model, 5, {}, {}), PressedBumpers{});
}

PioneerConfig InFrontOfAWall(const char* subclass, double wall_m) {
  PioneerConfig config;
  config.model = *FindPioneerModel(subclass);
  const double radius_m = config.model.radius_mm / 1000.0;
  config.blocked = [=](const PlanePose& pose) { return pose.x_m + radius_m > wall_m; };
  config.range = WallAt(wall_m);
  return config;
}

TEST(PioneerWorldTest, AWallIsSeenThenFeltThenLeft) {
  for (const PioneerModel& model : PioneerModels()) {
    SCOPED_TRACE(model.subclass);
    Client client(InFrontOfAWall(std::string(model.subclass).c_str(), 2));
    client.Connect();
    client.Send(testing::kEnable, 1);
    client.Send(testing::kVel, 300);
    client.Drive(15'000);
    EXPECT_NEAR(client.robot().drive().true_pose().x_m, 2 - model.radius_mm / 1000.0, 1e-3);
    EXPECT_EQ(client.last().stall() & 0x0101, 0x0101);
    EXPECT_EQ(client.last().stall() >> 9 & 0b10101, 0b00100);  // the middle one in front
    EXPECT_EQ(client.last().stall() >> 1 & 0x7F, 0);           // none behind
    client.Send(testing::kMove, -500);
    client.Drive(6000);
    EXPECT_EQ(client.last().stall(), 0);
    EXPECT_NEAR(client.robot().drive().true_pose().x_m, 1.5 - model.radius_mm / 1000.0, 2e-3);
  }
}

TEST(PioneerWorldTest, WithoutBumpersAStallAloneIsReported) {
  PioneerConfig config = InFrontOfAWall("p3dx", 0.5);
  config.bumpers = 0;
  Client client(config);
  client.ConnectAndEnable();
  client.Send(testing::kVel, 300);
  client.Drive(3000);
  EXPECT_EQ(client.last().stall(), 0x0101);
}

}  // namespace
}  // namespace pheromone::sim
