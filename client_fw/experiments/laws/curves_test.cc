#include "client_fw/experiments/laws/curves.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace pheromone::swarm {
namespace {

constexpr double kPi = std::numbers::pi;

double X(const field::Path& path, size_t i) {
  return static_cast<double>(path.points[i % path.points.size()].x) / 1e6;
}
double Y(const field::Path& path, size_t i) {
  return static_cast<double>(path.points[i % path.points.size()].y) / 1e6;
}

// The least radius of the circles through every `stride`th three points.
double LeastRadius(const field::Path& path, size_t stride) {
  double least = 1e9;
  const size_t count = path.points.size();
  for (size_t i = 0; i + 2 * stride < count; ++i) {
    const double ax = X(path, i);
    const double ay = Y(path, i);
    const double bx = X(path, i + stride) - ax;
    const double by = Y(path, i + stride) - ay;
    const double cx = X(path, i + 2 * stride) - ax;
    const double cy = Y(path, i + 2 * stride) - ay;
    const double twice_area = std::abs(bx * cy - by * cx);
    const double sides = std::hypot(bx, by) * std::hypot(cx, cy) * std::hypot(bx - cx, by - cy);
    least = twice_area > 1e-9 ? std::min(least, sides / (2 * twice_area)) : least;
  }
  return least;
}

TEST(Curves, HaveTheLengthsOfTheirFormulas) {
  // Bernoulli's lemniscate of half-width a: 5.24412 a.
  EXPECT_NEAR(field::LengthOf(PathOf(Curve::kEight)) / 1e6, 5.24412 * 2.4, 0.01);
  EXPECT_NEAR(field::LengthOf(PathOf(Curve::kSquare)) / 1e6, 4 * 2.2 + 2 * kPi * 0.4, 0.01);
  // The spiral r = 2.6 - k t, integrated step by step.
  double length = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double r = 2.6 - 2 * (i + 0.5) / 100'000;
    length += std::hypot(r * 1.2 * 2 * kPi, 2.0) / 100'000;
  }
  EXPECT_NEAR(field::LengthOf(PathOf(Curve::kSpiral)) / 1e6, length, 0.01);
}

TEST(Curves, AreAsTightAsTheHeaderSays) {
  EXPECT_NEAR(LeastRadius(PathOf(Curve::kEight), 4), 0.8, 0.02);
  EXPECT_NEAR(LeastRadius(PathOf(Curve::kSquare), 4), 0.4, 0.02);
  EXPECT_NEAR(LeastRadius(PathOf(Curve::kSpiral), 4), 0.6, 0.06);
}

TEST(Curves, LieOnTheMapWithRoomForARobot) {
  for (const std::vector<Curve>& curves : {TuningCurves(), UnseenCurves()}) {
    for (const Curve curve : curves) {
      for (const field::PointUm point : PathOf(curve).points) {
        EXPECT_GE(std::min(point.x, point.y), 1'000'000) << NameOf(curve);
        EXPECT_LE(std::max(point.x, point.y), 9'000'000) << NameOf(curve);
      }
    }
  }
}

TEST(Curves, NoneIsBothTunedOnAndUnseen) {
  for (const Curve curve : TuningCurves()) {
    EXPECT_EQ(std::count(UnseenCurves().begin(), UnseenCurves().end(), curve), 0);
  }
}

}  // namespace
}  // namespace pheromone::swarm
