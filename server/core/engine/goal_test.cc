// What a robot with a goal is told, compared with the equations of goal.h in floating point.

#include "server/core/engine/goal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "server/core/engine/testing/bench.h"
#include "server/core/field/route.h"

namespace pheromone::engine {
namespace {

using field::Intensities;
using field::PointUm;
using field::PoseUm;

struct Point {
  double x = 0;
  double y = 0;
};

Point InMetres(PointUm point) {
  return {static_cast<double>(point.x) / 1e6, static_cast<double>(point.y) / 1e6};
}

double Distance(Point a, Point b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

// The point of the route half a metre on from the nearest one, found in steps of 0.1 mm.
Point NaiveTarget(const std::vector<PointUm>& route, Point robot) {
  std::vector<Point> fine;
  for (size_t i = 1; i < route.size(); ++i) {
    const Point a = InMetres(route[i - 1]);
    const Point b = InMetres(route[i]);
    const int steps = static_cast<int>(Distance(a, b) / 1e-4) + 1;
    for (int step = 0; step < steps; ++step) {
      fine.push_back({a.x + (b.x - a.x) * step / steps, a.y + (b.y - a.y) * step / steps});
    }
  }
  fine.push_back(InMetres(route.back()));
  size_t nearest = 0;
  for (size_t i = 0; i < fine.size(); ++i) {
    if (Distance(fine[i], robot) <= Distance(fine[nearest], robot)) {
      nearest = i;
    }
  }
  double travelled = 0;
  while (nearest + 1 < fine.size() && travelled < 0.5) {
    travelled += Distance(fine[nearest], fine[nearest + 1]);
    ++nearest;
  }
  return fine[nearest];
}

struct NaiveSides {
  double left = 0;
  double right = 0;
};

NaiveSides NaiveLead(const Goal& goal, const PoseUm& pose) {
  const Point robot = InMetres(pose.position);
  const Point target = NaiveTarget(goal.route, robot);
  const double heading = pose.heading * 2 * std::numbers::pi / 65'536;
  const double x = target.x - robot.x;
  const double y = target.y - robot.y;
  const double ahead = x * std::cos(heading) + y * std::sin(heading);
  const double left = y * std::cos(heading) - x * std::sin(heading);
  const double share = std::abs(left) / (std::abs(left) + std::abs(ahead));
  const double turn = ahead >= 0 ? share : 2 - share;
  const double rho = Distance(InMetres(goal.point()), robot);
  const double difference = std::min(2 * turn, rho <= 1 ? 2.0 : 1.0);
  const double strength = std::clamp(rho * rho / (1.4 * 1.4), 1.0 / 4096, 1.0);
  const double weaker = strength - difference;
  return left >= 0 ? NaiveSides{4096 * strength, 4096 * weaker}
                   : NaiveSides{4096 * weaker, 4096 * strength};
}

Goal To(double x_m, double y_m) {
  return {{{static_cast<int64_t>(x_m * 1e6), static_cast<int64_t>(y_m * 1e6)}}, 100'000};
}

PoseUm Pose(double x_m, double y_m, double degrees) {
  return {{static_cast<int64_t>(x_m * 1e6), static_cast<int64_t>(y_m * 1e6)},
          static_cast<uint16_t>(std::lround(degrees / 360 * 65'536))};
}

TEST(Goal, IntensitiesAreThoseOfTheEquations) {
  std::mt19937 random(3);
  const auto any = [&] { return static_cast<int64_t>(random() % 10'000'000); };
  for (int i = 0; i < 100; ++i) {
    Goal goal;
    const auto corners = 1 + random() % 4;
    for (size_t corner = 0; corner <= corners; ++corner) {
      goal.route.push_back({any(), any()});
    }
    const PoseUm pose{{any(), any()}, static_cast<uint16_t>(random())};
    const Intensities p = LeadTo(goal, pose, {});
    const NaiveSides naive = NaiveLead(goal, pose);
    // Ahead or behind, left and right are the same; the naive target is off by up to 0.1 mm.
    if (naive.left != naive.right) {
      EXPECT_NEAR(static_cast<double>(p.left), naive.left, 8) << i;
      EXPECT_NEAR(static_cast<double>(p.right), naive.right, 8) << i;
    }
  }
}

TEST(Goal, ARobotThatFacesItDrivesStraightOnAndTurnsTowardsItOtherwise) {
  EXPECT_EQ(LeadTo(To(5, 5), Pose(1, 5, 0), {}), (Intensities{4096, 4096}));
  EXPECT_EQ(LeadTo(To(5, 5), Pose(5, 1, 90), {}), (Intensities{4096, 4096}));
  EXPECT_EQ(LeadTo(To(5, 5), Pose(4.3, 5, 0), {}), (Intensities{1024, 1024}));  // slower
  // Half a right angle and more: the wheel on that side stops.
  EXPECT_EQ(LeadTo(To(5, 5), Pose(5, 1, 45), {}), (Intensities{4096, 0}));
  EXPECT_EQ(LeadTo(To(5, 5), Pose(5, 1, 135), {}), (Intensities{0, 4096}));
  EXPECT_EQ(LeadTo(To(5, 5), Pose(5, 1, 0), {}), (Intensities{4096, 0}));
  EXPECT_EQ(LeadTo(To(5, 5), Pose(9, 5, 0), {}), (Intensities{4096, 0}));  // behind: to the left
  // Near it, the robot turns on the spot.
  EXPECT_EQ(LeadTo(To(5, 5), Pose(5, 4.5, 0), {}), (Intensities{522, 522 - 8192}));
}

TEST(Goal, RepellentsStayAndTrailsDoNot) {
  const Goal goal = To(5, 5);
  EXPECT_EQ(LeadTo(goal, Pose(1, 5, 0), {900, 700}), (Intensities{4096, 4096}));
  EXPECT_EQ(LeadTo(goal, Pose(1, 5, 0), {-5000, 700}), (Intensities{-904, 4096}));
  EXPECT_EQ(LeadTo(goal, Pose(1, 5, 0), {-5000, -6000}), (Intensities{-904, -1904}));
}

TEST(Goal, IsReachedWithinItsTolerance) {
  const Goal goal{{{5'000'000, 5'000'000}}, 100'000};
  EXPECT_TRUE(IsAt(goal, {5'000'000, 5'000'000}));
  EXPECT_TRUE(IsAt(goal, {5'100'000, 5'000'000}));
  EXPECT_FALSE(IsAt(goal, {5'100'001, 5'000'000}));
  EXPECT_TRUE(IsAt(goal, {5'060'000, 4'920'000}));
  EXPECT_FALSE(IsAt(goal, {5'071'000, 5'071'000}));
  EXPECT_FALSE(IsAt(goal, {std::numeric_limits<int64_t>::max(), 0}));
  EXPECT_FALSE(IsAt(goal, {std::numeric_limits<int64_t>::min(), 0}));
}

TEST(Goal, TheLargestMapFitsTheArithmetic) {
  constexpr int64_t kFar = 2 * field::MapGeometry::kMaxUm;
  for (const PointUm from : {PointUm{kFar, kFar}, PointUm{-kFar, kFar}, PointUm{kFar, -kFar}}) {
    const Goal goal{{from, {-from.x, -from.y}}, 100'000};
    const Intensities p = LeadTo(goal, {{from.x, -from.y}, 0}, {});
    EXPECT_EQ(std::max(p.left, p.right), 4096);
    EXPECT_GE(std::min(p.left, p.right), 0);
  }
}

TEST(Goal, IsChecked) {
  field::FieldConfig field = testing::SmallConfig().field;
  field::ObstacleMask mask(field.map.columns(), field.map.rows());
  mask.Set({30, 30});
  field.obstacles = field::Shared(std::move(mask));
  EXPECT_TRUE(CheckGoal(To(5, 5), field).ok());
  EXPECT_EQ(CheckGoal(To(3, 3), field).error(), "the goal is blocked by an obstacle");
  EXPECT_EQ(CheckGoal(To(10.1, 3), field).error(),
            "the goal or its route is off the map: x from 0 to 10 m, y from 0 to 10 m");
  EXPECT_EQ(CheckGoal(Goal{}, field).error(), "a route of 0 points, expected 1 to 256");
  EXPECT_EQ(CheckGoal(Goal{std::vector<PointUm>(257), 100'000}, field).error(),
            "a route of 257 points, expected 1 to 256");
  EXPECT_EQ(CheckGoal(Goal{{{}}, 9'999}, field).error(),
            "goal.tolerance_um is 9999, expected 10000 to 1000000000");
}

}  // namespace
}  // namespace pheromone::engine
