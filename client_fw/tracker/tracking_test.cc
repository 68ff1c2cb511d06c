#include "client_fw/tracker/tracking.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "client_fw/tracker/testing/settings.h"

namespace pheromone::tracker {
namespace {

constexpr double kHeightM = 3;  // of a camera above (2, 1.5) that looks straight down, focal 900

Point SeenFromAbove(double x, double y, double z, double shift_px = 0) {
  return {640 + shift_px + 900 * (x - 2) / (kHeightM - z), 480 - 900 * (y - 1.5) / (kHeightM - z)};
}

// A tag that heads east: its lower left corner is north-west.
Detection TagAt(int id, double x, double y, double z, double edge, double shift_px = 0) {
  const double h = edge / 2;
  return {id,
          {SeenFromAbove(x - h, y + h, z, shift_px), SeenFromAbove(x - h, y - h, z, shift_px),
           SeenFromAbove(x + h, y - h, z, shift_px), SeenFromAbove(x + h, y + h, z, shift_px)}};
}

Settings StraightDown() {
  Settings settings = ParseSettings(SettingsOfTheScene(), "c.toml").value();
  settings.lens = {900, {640, 480}, 0, 0};
  for (FloorTag& it : settings.floor) {
    it.heading_rad = 0;
  }
  settings.robots.resize(2);
  return settings;
}

std::vector<Detection> Floor(double shift_px = 0) {
  std::vector<Detection> found;
  for (const RenderedTag& it : FloorOfTheScene()) {
    found.push_back(TagAt(it.id, it.x_m, it.y_m, 0, kFloorEdgeM, shift_px));
  }
  return found;
}

TEST(TrackingTest, TellsWhoIsSeenAndWhoIsMissed) {
  Tracking tracking(StraightDown());
  auto found = Floor();
  found.push_back(TagAt(2, 1.25, 0.75, kRobotHeightM, kRobotEdgeM));
  found.push_back(TagAt(99, 2.25, 0.75, kRobotHeightM, kRobotEdgeM));  // nobody's
  const View view = tracking.Locate(found);
  ASSERT_TRUE(view.camera) << view.why_no_camera;
  ASSERT_EQ(view.seen.size(), 1u);
  EXPECT_EQ(view.seen[0].robot.id, 2);
  EXPECT_NEAR(view.seen[0].place.x(), 1.25, 1e-6);
  EXPECT_NEAR(view.seen[0].place.y(), 0.75, 1e-6);
  EXPECT_NEAR(view.seen[0].heading_rad, 0, 1e-6);
  ASSERT_EQ(view.missed.size(), 1u);
  EXPECT_EQ(view.missed[0].id, 1);
  EXPECT_EQ(view.floor_seen.size(), 6u);
}

// On a robot that heads north, a tag 0.1 m ahead of its centre and 0.02 m to the left, which is
// turned by -90 degrees and so heads east.
TEST(TrackingTest, KnowsWhereATagIsOnItsRobot) {
  Settings settings = StraightDown();
  settings.robots[0].forward_m = 0.1;
  settings.robots[0].left_m = 0.02;
  settings.robots[0].turn_rad = -std::acos(0.0);
  Tracking tracking(settings);
  auto found = Floor();
  found.push_back(TagAt(1, 1, 1, kRobotHeightM, kRobotEdgeM));
  const View view = tracking.Locate(found);
  ASSERT_EQ(view.seen.size(), 1u);
  EXPECT_NEAR(view.seen[0].place.x(), 1.02, 1e-6);
  EXPECT_NEAR(view.seen[0].place.y(), 0.9, 1e-6);
  EXPECT_NEAR(view.seen[0].heading_rad, std::acos(0.0), 1e-6);
}

TEST(TrackingTest, RemembersFloorTagsThatAreHidden) {
  Tracking tracking(StraightDown());
  EXPECT_TRUE(tracking.Locate(Floor()).camera);
  const View view = tracking.Locate(std::vector{Floor().front()});
  EXPECT_TRUE(view.camera);
  EXPECT_EQ(view.floor_seen.size(), 1u);
  EXPECT_FALSE(view.moved);
}

// Who bumps into the camera may turn it to where robots are but no floor tags.
TEST(TrackingTest, WithoutAnyFloorTagItForgetsTheCameraInAMoment) {
  Tracking tracking(StraightDown());
  const Detection robot = TagAt(1, 1, 1, kRobotHeightM, kRobotEdgeM);
  tracking.Locate(Floor());
  for (int i = 0; i < kMaxBlind; ++i) {
    EXPECT_EQ(tracking.Locate(std::vector{robot}).seen.size(), 1u);
  }
  for (int i = 0; i < kMaxBlind; ++i) {
    const View view = tracking.Locate(std::vector{robot});
    EXPECT_FALSE(view.camera);
    EXPECT_TRUE(view.seen.empty());
    EXPECT_EQ(view.why_no_camera,
              "no floor tag was seen in the last 10 pictures, expected at least one");
  }
  // One floor tag where it was tells that all are where they were.
  EXPECT_EQ(tracking.Locate(std::vector{Floor().front(), robot}).seen.size(), 1u);
}

TEST(TrackingTest, BeginsAgainWhenTheCameraIsMoved) {
  Tracking tracking(StraightDown());
  tracking.Locate(Floor());
  const View two = tracking.Locate(std::vector{Floor(40)[0], Floor(40)[1]});
  EXPECT_TRUE(two.moved);
  EXPECT_EQ(two.why_no_camera, "2 floor tags were seen, expected at least 3");
  const View all = tracking.Locate(Floor(40));
  ASSERT_TRUE(all.camera);
  EXPECT_LT(all.camera->rms_px, 1e-6);
}

TEST(TrackingTest, RejectsATagOfAnotherSizeOrHeight) {
  Tracking tracking(StraightDown());
  auto found = Floor();
  found.push_back(TagAt(1, 1, 1, 0.7, kRobotEdgeM));
  found.push_back(TagAt(2, 2, 1, kRobotHeightM, kRobotEdgeM));
  found.back().corners[0] += Point(6, 0);
  const View view = tracking.Locate(found);
  ASSERT_EQ(view.rejected.size(), 2u);
  EXPECT_EQ(view.rejected[0].why,
            "its edge seems to be 0.143 m, expected robot_edge_m, 0.120 m, at height_m, 0.250 m");
  EXPECT_NE(view.rejected[1].why.find("from a square"), std::string::npos);
}

TEST(TrackingTest, DoesNotChooseBetweenTwoTagsOfOneNumber) {
  Tracking tracking(StraightDown());
  auto found = Floor();
  found.push_back(TagAt(1, 1, 1, kRobotHeightM, kRobotEdgeM));
  found.push_back(TagAt(1, 2, 1, kRobotHeightM, kRobotEdgeM));
  EXPECT_TRUE(tracking.Locate(found).seen.empty());
}

TEST(DatagramTest, HaveALineForEachRobot) {
  SeenRobot robot;
  robot.robot.link = "radio-a";
  robot.robot.id = 7;
  robot.place = {2.35, -0.9};
  robot.heading_rad = -std::acos(0.0);
  EXPECT_EQ(Datagrams(std::vector{robot, robot}),
            std::vector<std::string>{"pose radio-a 7 2.3500 -0.9000 -90.00\n"
                                     "pose radio-a 7 2.3500 -0.9000 -90.00\n"});
  const auto many = Datagrams(std::vector<SeenRobot>(100, robot));
  EXPECT_GT(many.size(), 1u);
  for (const std::string& it : many) {
    EXPECT_LE(it.size(), 1400u);
    EXPECT_EQ(it.back(), '\n');
  }
  EXPECT_TRUE(Datagrams({}).empty());
}

}  // namespace
}  // namespace pheromone::tracker
