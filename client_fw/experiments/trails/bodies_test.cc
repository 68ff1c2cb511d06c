#include "client_fw/experiments/trails/bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace pheromone::swarm {
namespace {

// Step by step along the ray.
double NaiveRange(const std::vector<sim::PlanePose>& poses, size_t self, const sim::PlanePose& from,
                  double reach_m, double radius_m) {
  constexpr double kStepM = 0.0005;
  for (int i = 0; i * kStepM <= reach_m; ++i) {
    const double at_m = i * kStepM;
    const double x_m = from.x_m + at_m * std::cos(from.heading_rad);
    const double y_m = from.y_m + at_m * std::sin(from.heading_rad);
    for (size_t body = 0; body < poses.size(); ++body) {
      if (body != self && std::hypot(poses[body].x_m - x_m, poses[body].y_m - y_m) <= radius_m) {
        return at_m;
      }
    }
  }
  return std::numeric_limits<double>::infinity();
}

TEST(BodiesTest, SonarsMeasureToTheNearestOtherBody) {
  std::mt19937 random(1);
  const auto draw = [&](double most) { return most * static_cast<double>(random()) / 0xFFFFFFFF; };
  int hits = 0;
  for (int round = 0; round < 200; ++round) {
    Bodies bodies(0.25);
    std::vector<sim::PlanePose> poses;
    for (int i = 0; i < 5; ++i) {
      poses.push_back({draw(6), draw(6), 0});
      EXPECT_EQ(bodies.Add(poses.back()), poses.size() - 1);
    }
    const sim::PlanePose from{poses[2].x_m, poses[2].y_m, draw(7)};
    const double measured = bodies.RangeFrom(2)(from, 5);
    const double naive = NaiveRange(poses, 2, from, 5, 0.25);
    hits += std::isfinite(naive) ? 1 : 0;
    if (std::isfinite(naive)) {
      EXPECT_NEAR(measured, naive, 0.02);  // the naive ray may pass a rim between two steps
    } else {
      EXPECT_GT(measured, 4.99);
    }
  }
  EXPECT_GT(hits, 20);
}

TEST(BodiesTest, ABodyStopsAnotherOneThatComesNearerAndLetsItGo) {
  Bodies bodies(0.25);
  const size_t a = bodies.Add({0, 0, 0});
  const size_t b = bodies.Add({0.51, 0, 0});
  const sim::Blocked blocked = bodies.BlockedFor(b);
  EXPECT_FALSE(blocked({0.505, 0, 0}));
  EXPECT_TRUE(blocked({0.495, 0, 0}));
  bodies.Move(a, {0.02, 0, 0});  // 0.49 m apart
  EXPECT_FALSE(blocked({0.512, 0, 0}));
  EXPECT_TRUE(blocked({0.508, 0, 0}));
}

TEST(BodiesTest, TheNearestPairIsOfAll) {
  Bodies bodies(0.25);
  EXPECT_TRUE(std::isinf(bodies.Nearest().gap_m));
  bodies.Add({0, 0, 0});
  bodies.Add({3, 0, 0});
  bodies.Add({3, 1, 0});
  const Bodies::Pair nearest = bodies.Nearest();
  EXPECT_EQ(nearest.a, 1u);
  EXPECT_EQ(nearest.b, 2u);
  EXPECT_NEAR(nearest.gap_m, 0.5, 1e-9);
}

}  // namespace
}  // namespace pheromone::swarm
