#include "client_fw/boards/host/plane_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace pheromone::client {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(PlanePose, CoordinatesAreRoundedToMillimetres) {
  const Pose pose = ToClientPose({1.2345, -0.0006, 0});
  EXPECT_EQ(pose.x_mm, 1235);
  EXPECT_EQ(pose.y_mm, -1);
  EXPECT_EQ(ToClientPose({1.2344, 0, 0}).x_mm, 1234);
}

TEST(PlanePose, AnglesAreReducedToATurn) {
  EXPECT_EQ(ToClientPose({0, 0, kPi / 2}).heading, 0x4000);
  EXPECT_EQ(ToClientPose({0, 0, -kPi / 2}).heading, 0xC000);
  EXPECT_EQ(ToClientPose({0, 0, 2 * kPi}).heading, 0);
  EXPECT_EQ(ToClientPose({0, 0, 7 * kPi}).heading, 0x8000);
}

// 2^24 mm.
TEST(PlanePose, WhatTheProtocolCannotTellIsNotReportable) {
  EXPECT_TRUE(IsReportable({16777.216, -16777.216, 1e6}));
  EXPECT_FALSE(IsReportable({16777.217, 0, 0}));
  EXPECT_FALSE(IsReportable({0, -16777.217, 0}));
  EXPECT_FALSE(IsReportable({NAN, 0, 0}));
  EXPECT_FALSE(IsReportable({0, NAN, 0}));
  EXPECT_FALSE(IsReportable({0, 0, INFINITY}));
}

}  // namespace
}  // namespace pheromone::client
