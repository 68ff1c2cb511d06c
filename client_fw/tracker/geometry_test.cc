#include "client_fw/tracker/geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace pheromone::tracker {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

// A camera written out in plain numbers: at (x, y, z), looking down, then tilted by `tilt` about
// its x axis and turned by `turn` about the vertical.
struct PlainCamera {
  double x = 2, y = 1.5, z = 3, tilt = 0, turn = 0;
  double focal = 1000, u0 = 640, v0 = 480, k1 = 0, k2 = 0;

  Point See(double px, double py, double pz) const {
    const double east = px - x;
    const double north = py - y;
    const double right = std::cos(turn) * east + std::sin(turn) * north;
    const double ahead = -std::sin(turn) * east + std::cos(turn) * north;
    const double below = z - pz;
    const double down = -std::cos(tilt) * ahead + std::sin(tilt) * below;
    const double depth = std::sin(tilt) * ahead + std::cos(tilt) * below;
    const double a = right / depth;
    const double b = down / depth;
    const double r2 = a * a + b * b;
    const double bend = 1 + k1 * r2 + k2 * r2 * r2;
    return {u0 + focal * bend * a, v0 + focal * bend * b};
  }
  Lens lens() const { return {focal, {u0, v0}, k1, k2}; }
};

std::vector<Match> Grid(const PlainCamera& camera) {
  std::vector<Match> matches;
  for (const double x : {0.3, 0.7, 1.1, 1.9, 2.4, 3.1, 3.6}) {
    for (const double y : {0.2, 0.6, 1.4, 1.8, 2.2, 2.7}) {
      matches.push_back({{x, y}, camera.See(x, y, 0)});
    }
  }
  return matches;
}

const PlainCamera kTilted{1.8, 1.2, 2.9, 12 * kDegree, 30 * kDegree, 900, 650, 470, -0.2, 0.04};

TEST(HomographyTest, MapsPointsThatItWasNotFittedTo) {
  PlainCamera camera = kTilted;
  camera.k1 = camera.k2 = 0;
  const auto h = FitHomography(Grid(camera));
  ASSERT_TRUE(h);
  const Eigen::Vector3d seen = *h * Eigen::Vector3d(1.9, 0.7, 1);
  EXPECT_LT((seen.head<2>() / seen.z() - camera.See(1.9, 0.7, 0)).norm(), 1e-8);
}

TEST(HomographyTest, NeedsFourPointsThatAreNotOnALine) {
  const auto all = Grid(PlainCamera());
  EXPECT_FALSE(FitHomography(std::span(all).first(3)));
  std::vector<Match> line;
  for (const double x : {0., 1., 2., 3., 4.}) {
    line.push_back({{x, 2 * x}, PlainCamera().See(x, 2 * x, 0)});
  }
  EXPECT_FALSE(FitHomography(line));
}

TEST(LensTest, UndistortsWhatWasDistorted) {
  const Lens lens = kTilted.lens();
  for (const Point& direction : {Point(0, 0), Point(0.5, -0.3), Point(-0.6, 0.45)}) {
    const auto back = Undistort(lens, Distort(lens, direction));
    ASSERT_TRUE(back);
    EXPECT_LT((*back - direction).norm(), 1e-10);
  }
}

TEST(LensTest, HasNoInverseBeyondItsFold) {
  // r (1 - r^2 / 2) grows up to r = sqrt(2 / 3), where it is 0.544.
  const Lens lens{1000, {640, 480}, -0.5, 0};
  EXPECT_TRUE(Undistort(lens, {640 + 500, 480}));
  EXPECT_FALSE(Undistort(lens, {640 + 600, 480}));
}

TEST(CameraTest, IsFoundFromTheFloor) {
  const auto fit = FitCamera(kTilted.lens(), Grid(kTilted));
  ASSERT_TRUE(fit.ok()) << fit.error();
  EXPECT_LT(fit.value().rms_px, 1e-6);
  EXPECT_LT((fit.value().camera.place() - Eigen::Vector3d(1.8, 1.2, 2.9)).norm(), 1e-6);
  const Eigen::Vector3d high(0.6, 2.1, 0.4);
  EXPECT_LT((Project(fit.value().camera, high) - kTilted.See(0.6, 2.1, 0.4)).norm(), 1e-5);
}

TEST(CameraTest, IsFoundFromNoisyCorners) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.3);
  std::vector<Match> floor = Grid(kTilted);
  for (Match& it : floor) {
    it.pixel += Point(noise(random), noise(random));
  }
  const auto fit = FitCamera(kTilted.lens(), floor);
  ASSERT_TRUE(fit.ok()) << fit.error();
  EXPECT_NEAR(fit.value().rms_px, 0.3 * std::sqrt(2), 0.08);
  EXPECT_LT((fit.value().camera.place() - Eigen::Vector3d(1.8, 1.2, 2.9)).norm(), 0.02);
}

TEST(CameraTest, WorksWhereTheMapsOriginIsBehindIt) {
  const PlainCamera camera{50, 40, 3, 35 * kDegree, 0, 900, 640, 480};
  std::vector<Match> floor;
  for (const double x : {49., 50., 51.}) {
    for (const double y : {41., 42.}) {
      floor.push_back({{x, y}, camera.See(x, y, 0)});
    }
  }
  const auto fit = FitCamera(camera.lens(), floor);
  ASSERT_TRUE(fit.ok()) << fit.error();
  EXPECT_LT((fit.value().camera.place() - Eigen::Vector3d(50, 40, 3)).norm(), 1e-5);
}

TEST(CameraTest, RefusesAMirroredFloor) {
  std::vector<Match> floor = Grid(kTilted);
  for (Match& it : floor) {
    it.place.x() = -it.place.x();
  }
  EXPECT_NE(FitCamera(kTilted.lens(), floor).ErrorOr("").find("mirrored"), std::string::npos);
}

TEST(CameraTest, RefusesTagsOnALine) {
  std::vector<Match> floor;
  for (const double x : {0., 1., 2., 3.}) {
    floor.push_back({{x, 1}, kTilted.See(x, 1, 0)});
  }
  EXPECT_NE(FitCamera(kTilted.lens(), floor).ErrorOr("").find("on one line"), std::string::npos);
}

// Straight below, and one metre beside the camera's foot, where a height of 0.3 m of 3 m shifts
// what is taken for the floor by a ninth of a metre.
TEST(TagTest, IsFoundAtItsHeight) {
  const PlainCamera plain;
  const auto fit = FitCamera(plain.lens(), Grid(plain));
  ASSERT_TRUE(fit.ok()) << fit.error();
  const Camera& camera = fit.value().camera;
  const Point seen = plain.See(3, 1.5, 0.3);
  EXPECT_NEAR(OntoPlane(camera, seen, 0.3)->x(), 3, 1e-6);
  EXPECT_NEAR(OntoPlane(camera, seen, 0)->x(), 2 + 1 * 3 / 2.7, 1e-6);
}

TEST(TagTest, HasThePoseOfItsUpperEdge) {
  const auto fit = FitCamera(kTilted.lens(), Grid(kTilted));
  ASSERT_TRUE(fit.ok()) << fit.error();
  // Heading north: the upper edge is north, so lower left is south-west.
  const double h = 0.25;
  const Corners north = {kTilted.See(0.94, 0.94, h), kTilted.See(1.06, 0.94, h),
                         kTilted.See(1.06, 1.06, h), kTilted.See(0.94, 1.06, h)};
  const auto pose = FitTag(fit.value().camera, north, 0.12, h);
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->centre.x(), 1, 1e-6);
  EXPECT_NEAR(pose->centre.y(), 1, 1e-6);
  EXPECT_NEAR(pose->heading_rad, 90 * kDegree, 1e-6);
  EXPECT_NEAR(pose->edge_m, 0.12, 1e-6);
  EXPECT_LT(pose->rms_px, 1e-4);
  // Taken for one on the floor it seems larger, which tells.
  EXPECT_NEAR(FitTag(fit.value().camera, north, 0.12, 0)->edge_m, 0.12 * 2.9 / 2.65, 1e-3);
}

TEST(TagTest, IsNothingAboveTheHorizon) {
  const PlainCamera camera{2, 1.5, 3, 80 * kDegree, 0, 900, 640, 480};
  std::vector<Match> floor;
  for (const double x : {0., 2., 4.}) {
    for (const double y : {6., 9.}) {
      floor.push_back({{x, y}, camera.See(x, y, 0)});
    }
  }
  const auto fit = FitCamera(camera.lens(), floor);
  ASSERT_TRUE(fit.ok()) << fit.error();
  EXPECT_TRUE(OntoPlane(fit.value().camera, {640, 900}, 0));
  EXPECT_FALSE(OntoPlane(fit.value().camera, {640, 10}, 0));
}

}  // namespace
}  // namespace pheromone::tracker
