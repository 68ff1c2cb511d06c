// From rendered pictures to poses: renderer, detector and geometry together.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "client_fw/tracker/detector.h"
#include "client_fw/tracker/geometry.h"
#include "client_fw/tracker/testing/scene.h"

namespace pheromone::tracker {
namespace {

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? NAN : values[values.size() / 2];
}

// The errors of all robots that were seen, at some number of pictures.
struct Errors {
  std::vector<double> millimetres;
  std::vector<double> degrees;
  int floor_tags = 0;
};

Errors ErrorsOf(Renderer* renderer, const Lens& lens, int pictures) {
  std::mt19937 random(3);
  Detector detector;
  Errors errors;
  for (int i = 0; i < pictures; ++i) {
    const std::vector<RenderedTag> robots = RobotsOfTheScene(&random);
    std::map<int, Corners> seen;
    for (const Detection& it : detector.Detect(renderer->Render(robots))) {
      EXPECT_TRUE(seen.emplace(it.id, it.corners).second) << it.id;
    }
    std::vector<Match> floor;
    for (const RenderedTag& it : FloorOfTheScene()) {
      const Corners square = SquareAt({it.x_m, it.y_m}, it.heading_rad, it.edge_m);
      for (size_t k = 0; seen.contains(it.id) && k < 4; ++k) {
        floor.push_back({square[k], seen[it.id][k]});
      }
    }
    errors.floor_tags += static_cast<int>(floor.size()) / 4;
    const auto camera = FitCamera(lens, floor);
    EXPECT_TRUE(camera.ok()) << camera.ErrorOr("");
    for (const RenderedTag& it : robots) {
      if (camera.ok() && seen.contains(it.id)) {
        const auto pose = FitTag(camera.value().camera, seen[it.id], kRobotEdgeM, kRobotHeightM);
        EXPECT_TRUE(pose);
        errors.millimetres.push_back(1000 * (pose->centre - Point(it.x_m, it.y_m)).norm());
        errors.degrees.push_back(
            std::abs(std::remainder(pose->heading_rad - it.heading_rad, 2 * std::numbers::pi)) *
            180 / std::numbers::pi);
      }
    }
  }
  return errors;
}

void ExpectAccurate(const Errors& errors, int pictures, double most_mm) {
  EXPECT_GE(errors.floor_tags, 5 * pictures);
  EXPECT_GE(errors.millimetres.size(), static_cast<size_t>(12 * pictures * 3 / 4));
  EXPECT_LE(Median(errors.millimetres), most_mm);
  EXPECT_LE(Median(errors.degrees), 1);
}

// Two cables hide parts of some tags; these may be missed.
TEST(AccuracyTest, TwelveRobotsAreWithinFiveMillimetresAndOneDegree) {
  Renderer renderer(CameraOfTheScene(), FloorOfTheScene(), CablesOfTheScene(), {});
  ExpectAccurate(ErrorsOf(&renderer, CameraOfTheScene().lens, 4), 4, 5);
}

TEST(AccuracyTest, AlsoInABlurredPictureWithMuchNoise) {
  Renderer renderer(CameraOfTheScene(), FloorOfTheScene(), {}, {.noise = 12, .blur_px = 1.4});
  ExpectAccurate(ErrorsOf(&renderer, CameraOfTheScene().lens, 4), 4, 5);
}

TEST(AccuracyTest, ALensThatIsTakenForAStraightOneShiftsRobots) {
  Renderer renderer(CameraOfTheScene(), FloorOfTheScene(), {}, {});
  Lens straight = CameraOfTheScene().lens;
  straight.k1 = straight.k2 = 0;
  EXPECT_GT(Median(ErrorsOf(&renderer, straight, 2).millimetres), 10);
}

TEST(DetectorTest, FindsNothingOnABareFloor) {
  Renderer renderer(CameraOfTheScene(), {}, {}, {});
  EXPECT_TRUE(Detector().Detect(renderer.Render({})).empty());
}

}  // namespace
}  // namespace pheromone::tracker
