#include "client_fw/tracker/calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "client_fw/tracker/picture.h"
#include "client_fw/tracker/rendering.h"
#include "server/base/file.h"

namespace pheromone::tracker {
namespace {

constexpr double kDegrees = 3.14159265358979323846 / 180;

struct BoardCamera {
  double tilt, turn, height, x, y;
};

// Above the middle of the board, 0.11 m to the right and 0.07 m down, from five sides.
constexpr BoardCamera kCameras[] = {{0.0, 0.1, 0.30, 0, 0},      {0.5, 0.0, 0.24, 0, -0.13},
                                    {0.5, 1.6, 0.24, 0.13, 0},   {0.5, 3.1, 0.25, 0, 0.13},
                                    {0.55, 4.7, 0.24, -0.13, 0}, {0.4, 0.8, 0.26, 0.1, -0.07}};

// Pinhole and bend, written out.
Point See(const BoardCamera& camera, const Lens& lens, double x, double y) {
  const double east = x - 0.11 - camera.x;
  const double north = y + 0.066 - camera.y;
  const double right = std::cos(camera.turn) * east + std::sin(camera.turn) * north;
  const double ahead = -std::sin(camera.turn) * east + std::cos(camera.turn) * north;
  const double depth = std::sin(camera.tilt) * ahead + std::cos(camera.tilt) * camera.height;
  const double a = right / depth;
  const double b = (std::sin(camera.tilt) * camera.height - std::cos(camera.tilt) * ahead) / depth;
  const double r2 = a * a + b * b;
  const double bend = lens.focal_px * (1 + lens.k1 * r2 + lens.k2 * r2 * r2);
  return {lens.centre_px.x() + bend * a, lens.centre_px.y() + bend * b};
}

std::vector<BoardView> ViewsOf(const Lens& lens, size_t count) {
  std::vector<BoardView> views;
  for (size_t i = 0; i < count; ++i) {
    BoardView view;
    for (int column = 0; column < 6; ++column) {
      for (int row = 0; row < 4; ++row) {
        const double x = 0.044 * column;
        const double y = -0.044 * row;
        for (const double dx : {-0.016, 0.016}) {
          view.push_back({{x + dx, y - 0.016}, See(kCameras[i], lens, x + dx, y - 0.016)});
          view.push_back({{x + dx, y + 0.016}, See(kCameras[i], lens, x + dx, y + 0.016)});
        }
      }
    }
    views.push_back(view);
  }
  return views;
}

TEST(LensFitTest, FindsTheCoefficientsOfExactViews) {
  const Lens lens{820, {655, 468}, -0.21, 0.06};
  const auto fit = FitLens(ViewsOf(lens, 6), 1280, 960);
  ASSERT_TRUE(fit.ok()) << fit.error();
  EXPECT_LT(fit.value().rms_px, 1e-3);
  EXPECT_NEAR(fit.value().lens.focal_px, 820, 0.01);
  EXPECT_NEAR(fit.value().lens.centre_px.x(), 655, 0.01);
  EXPECT_NEAR(fit.value().lens.centre_px.y(), 468, 0.01);
  EXPECT_NEAR(fit.value().lens.k1, -0.21, 1e-4);
  EXPECT_NEAR(fit.value().lens.k2, 0.06, 1e-4);
}

TEST(LensFitTest, NeedsThreePictures) {
  EXPECT_NE(FitLens(ViewsOf({820, {640, 480}, 0, 0}, 2), 1280, 960).ErrorOr("").find("found 2"),
            std::string::npos);
}

TEST(LensFitTest, NeedsPicturesFromSeveralSides) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.2);
  std::vector<BoardView> views(4, ViewsOf({820, {640, 480}, 0, 0}, 1).front());
  EXPECT_NE(FitLens(views, 1280, 960).ErrorOr("").find("same side"), std::string::npos);
  for (BoardView& view : views) {
    for (Match& it : view) {
      it.pixel += Point(noise(random), noise(random));
    }
  }
  EXPECT_NE(FitLens(views, 1280, 960).ErrorOr("").find("same side"), std::string::npos);
}

// The printed board, rendered as it would be photographed.
TEST(LensFitTest, FindsTheLensOfRenderedPictures) {
  const Board board;
  std::vector<RenderedTag> tags;
  for (int i = 0; i < board.tags(); ++i) {
    // From the upper left along the rows, upright.
    tags.push_back({560 + i, 0.044 * (i % 6), -0.044 * (i / 6), 90 * kDegrees, 0.032, 0});
  }
  std::vector<std::string> paths;
  for (const BoardCamera& it : kCameras) {
    RenderedCamera camera{.width = 640, .height = 480, .lens = {460, {325, 236}, -0.2, 0.04}};
    camera.x_m = 0.11 + it.x;
    camera.y_m = -0.066 + it.y;
    camera.z_m = it.height;
    camera.turn_rad = it.turn;
    camera.tilt_rad = it.tilt;
    Renderer renderer(camera, tags, {}, {.noise = 3, .blur_px = 0.6});
    paths.push_back((std::filesystem::path(testing::TempDir()) /
                     ("pheromone_board_" + std::to_string(paths.size()) + ".png"))
                        .string());
    ASSERT_TRUE(WriteFile(paths.back(), EncodePng(renderer.Render({})).value()).ok());
  }
  const auto calibration = FitLensOfFiles(board, paths);
  std::for_each(paths.begin(), paths.end(),
                [](const std::string& path) { std::filesystem::remove(path); });
  ASSERT_TRUE(calibration.ok()) << calibration.error();
  EXPECT_EQ(calibration.value().used, 6u);
  EXPECT_EQ(calibration.value().width, 640);
  const LensFit& fit = calibration.value().fit;
  EXPECT_LT(fit.rms_px, 0.3);
  EXPECT_NEAR(fit.lens.focal_px, 460, 3);
  EXPECT_LT(std::abs(fit.lens.focal_px - 460), 5 * fit.focal_error_px + 0.5);
  EXPECT_NEAR(fit.lens.centre_px.x(), 325, 3);
  EXPECT_NEAR(fit.lens.centre_px.y(), 236, 3);
  EXPECT_NEAR(fit.lens.k1, -0.2, 0.02);
  EXPECT_GT(fit.covered, 0.7);
}

}  // namespace
}  // namespace pheromone::tracker
