#include "client_fw/experiments/bridge/arena.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace pheromone::swarm {
namespace {

constexpr double kStepM = 0.003;

double LengthOfPoints(const Lane& lane) {
  double length_m = 0;
  for (size_t i = 1; i < lane.points().size(); ++i) {
    length_m += std::hypot(lane.points()[i].x_m - lane.points()[i - 1].x_m,
                           lane.points()[i].y_m - lane.points()[i - 1].y_m);
  }
  return length_m;
}

// The least distance of a point from a lane, sampled.
double DistanceM(const Lane& lane, const sim::PlanePose& pose) {
  double least_m = 1e9;
  for (int mm = 0; mm <= lane.length_m() * 1000; mm += 2) {
    const sim::PlanePose at = lane.At(mm / 1000.0);
    least_m = std::min(least_m, std::hypot(at.x_m - pose.x_m, at.y_m - pose.y_m));
  }
  return least_m;
}

sim::PlanePose Ahead(const sim::PlanePose& pose, double metres) {
  return {pose.x_m + metres * std::cos(pose.heading_rad),
          pose.y_m + metres * std::sin(pose.heading_rad), pose.heading_rad};
}

// Drives straight on, turned a little at each fork, until `event`; true if it comes.
bool DriveTo(BridgeGuide::Step event, double turn_rad, bool short_open, BridgeGuide* guide,
             sim::PlanePose* pose) {
  for (int i = 0; i < 20'000; ++i) {
    const bool stem =
        guide->corridor() == (guide->outbound() ? BridgeArena::kNestStem : BridgeArena::kFoodStem);
    *pose = Ahead(*pose, kStepM);
    if (stem) {
      pose->heading_rad += turn_rad * kStepM;
    }
    if (guide->Hold(pose, short_open) == event) {
      return true;
    }
  }
  return false;
}

TEST(BridgeArena, TheLongBranchIsTwiceAsLong) {
  const BridgeArena arena({});
  const double short_m = LengthOfPoints(arena.lane(BridgeArena::kShortBranch, true));
  const double long_m = LengthOfPoints(arena.lane(BridgeArena::kLongBranch, true));
  EXPECT_GT(short_m, 3);
  EXPECT_NEAR(long_m, 2 * short_m, 1e-9);
  EXPECT_NEAR(arena.length_m(Branch::kShort), short_m, 1e-12);
}

TEST(BridgeArena, BothBranchesJoinTheForks) {
  for (const double ratio : {1.0, 1.5, 2.0, 2.5}) {
    BridgeShape shape;
    shape.ratio = ratio;
    const BridgeArena arena(shape);
    const Lane::Point from = arena.lane(BridgeArena::kNestStem, true).points().back();
    const Lane::Point to = arena.lane(BridgeArena::kFoodStem, true).points().front();
    for (const auto branch : {BridgeArena::kShortBranch, BridgeArena::kLongBranch}) {
      const Lane& lane = arena.lane(branch, true);
      EXPECT_NEAR(lane.points().front().x_m, from.x_m, 1e-9);
      EXPECT_NEAR(lane.points().front().y_m, from.y_m, 1e-9);
      EXPECT_NEAR(lane.points().back().x_m, to.x_m, 1e-9);
      EXPECT_NEAR(lane.points().back().y_m, to.y_m, 1e-9);
    }
  }
}

TEST(BridgeArena, AsFarAsARobotSmellsTheBranchesAreMirrorImages) {
  const BridgeArena arena({});
  for (const bool outbound : {false, true}) {
    for (int mm = 0; mm < 850; mm += 50) {
      const double along_m = mm / 1000.0;
      const sim::PlanePose a = arena.lane(BridgeArena::kShortBranch, outbound).At(along_m);
      const sim::PlanePose b = arena.lane(BridgeArena::kLongBranch, outbound).At(along_m);
      EXPECT_NEAR(a.x_m, b.x_m, 1e-9);
      EXPECT_NEAR(a.y_m + b.y_m, 2 * arena.shape().axis_y_m, 1e-9);
    }
  }
}

TEST(BridgeGuide, TheSideOfTheWedgeDecidesAndIsTheOtherOneOnTheWayBack) {
  const BridgeArena arena({});
  for (const double turn : {-0.05, 0.05}) {
    BridgeGuide guide(&arena);
    sim::PlanePose pose = guide.Start();
    ASSERT_TRUE(DriveTo(BridgeGuide::Step::kChose, turn, true, &guide, &pose));
    EXPECT_EQ(guide.branch(), turn > 0 ? Branch::kShort : Branch::kLong);
    ASSERT_TRUE(DriveTo(BridgeGuide::Step::kArrived, 0, true, &guide, &pose));
    guide.Turn(&pose);
    ASSERT_TRUE(DriveTo(BridgeGuide::Step::kChose, turn, true, &guide, &pose));
    EXPECT_EQ(guide.branch(), turn > 0 ? Branch::kLong : Branch::kShort);
    ASSERT_TRUE(DriveTo(BridgeGuide::Step::kArrived, 0, true, &guide, &pose));
    EXPECT_LT(DistanceM(arena.lane(BridgeArena::kNestStem, true), pose), 0.04);
    EXPECT_NEAR(pose.x_m, arena.shape().nest_x_m, 0.01);
  }
}

TEST(BridgeGuide, AClosedBranchCannotBeEntered) {
  const BridgeArena arena({});
  for (const double turn : {-0.5, 0.0, 0.5}) {
    BridgeGuide guide(&arena);
    sim::PlanePose pose = guide.Start();
    ASSERT_TRUE(DriveTo(BridgeGuide::Step::kChose, turn, false, &guide, &pose));
    EXPECT_EQ(guide.branch(), Branch::kLong);
    EXPECT_LE(pose.y_m, arena.shape().axis_y_m + 1e-9);
  }
}

TEST(BridgeGuide, NoDrivingLeavesTheCorridorsOrJumps) {
  const BridgeArena arena({});
  const double half_m = arena.shape().free_m;
  std::mt19937_64 random(7);
  BridgeGuide guide(&arena);
  sim::PlanePose pose = guide.Start();
  int arrivals = 0;
  for (int i = 0; i < 40'000; ++i) {
    const sim::PlanePose before = pose;
    pose = Ahead(pose, kStepM);
    pose.heading_rad += (static_cast<double>(random() % 2001) / 1000 - 1) * 0.3;
    if (guide.Hold(&pose, true) == BridgeGuide::Step::kArrived) {
      guide.Turn(&pose);
      ++arrivals;
      continue;
    }
    // Where lanes meet at an angle, a narrow corridor takes over from a wide one.
    ASSERT_LE(std::hypot(pose.x_m - before.x_m, pose.y_m - before.y_m), kStepM + 2 * half_m);
    if (i % 40 == 0) {
      double least_m = 1e9;
      for (const auto corridor : {BridgeArena::kNestStem, BridgeArena::kShortBranch,
                                  BridgeArena::kLongBranch, BridgeArena::kFoodStem}) {
        least_m = std::min(least_m, DistanceM(arena.lane(corridor, true), pose));
      }
      ASSERT_LE(least_m, half_m + 0.01);
    }
  }
  EXPECT_GT(arrivals, 4);
}

}  // namespace
}  // namespace pheromone::swarm
