// Sheets are drawn by rsvg-convert, and what is found on them is measured.
#include "client_fw/tracker/sheets.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "client_fw/tracker/annotated.h"
#include "client_fw/tracker/picture.h"
#include "client_fw/tracker/simulated_swarm.h"
#include "client_fw/tracker/testing/settings.h"
#include "server/base/file.h"

namespace pheromone::tracker {
namespace {

constexpr double kDotsPerMm = 150 / 25.4;

Picture Drawn(const std::string& svg) {
  const std::string name = (std::filesystem::path(testing::TempDir()) / "pheromone_sheet").string();
  EXPECT_TRUE(WriteFile(name + ".svg", svg).ok());
  const std::string command = "rsvg-convert --dpi-x 150 --dpi-y 150 --background-color=white " +
                              name + ".svg --output " + name + ".png";
  EXPECT_EQ(std::system(command.c_str()), 0);
  const auto picture = LoadPicture(name + ".png");
  EXPECT_TRUE(picture.ok()) << picture.error();
  std::filesystem::remove(name + ".svg");
  std::filesystem::remove(name + ".png");
  return picture.ok() ? picture.value() : Picture();
}

TEST(SheetTest, HasTheTagInItsSizeUpright) {
  const std::vector<Detection> found =
      Detector().Detect(Drawn(TagSheet(7, 0.12, "robot radio-a 7 < 8")));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].id, 7);
  const Corners& corners = found[0].corners;
  EXPECT_NEAR((corners[1] - corners[0]).norm(), 120 * kDotsPerMm, 1);
  EXPECT_NEAR((corners[2] - corners[1]).norm(), 120 * kDotsPerMm, 1);
  EXPECT_NEAR(corners[0].y(), corners[1].y(), 1);   // the lower edge is level
  EXPECT_GT(corners[0].y(), corners[3].y() + 100);  // and below
  EXPECT_GT(corners[1].x(), corners[0].x() + 100);
}

TEST(SheetTest, GrowsWithALargeTag) {
  const Picture picture = Drawn(TagSheet(500, 0.3, "floor"));
  EXPECT_NEAR(picture.width, 385 * kDotsPerMm, 2);
  EXPECT_EQ(Detector().Detect(picture).size(), 1u);
}

// All corners lie where the calibration takes them to be, on a scale of 150 dots an inch.
TEST(SheetTest, TheBoardIsWhatTheCalibrationKnows) {
  const Board board;
  const Picture picture = Drawn(BoardSheet(board));
  EXPECT_NEAR(picture.width, 297 * kDotsPerMm, 2);
  EXPECT_NEAR(picture.height, 210 * kDotsPerMm, 2);
  const BoardView view = ViewOf(board, Detector(1).Detect(picture));
  ASSERT_EQ(view.size(), 24 * 4u);
  for (const Match& it : view) {
    const Point sheet = (it.pixel - view[0].pixel) / (1000 * kDotsPerMm);
    const Point model = it.place - view[0].place;
    EXPECT_NEAR(sheet.x(), model.x(), 3e-4);
    EXPECT_NEAR(-sheet.y(), model.y(), 3e-4);
  }
}

TEST(AnnotatedTest, IsThePictureWithNames) {
  const Settings settings = ParseSettings(SettingsOfTheScene(), "c.toml").value();
  SimulatedSwarm swarm(settings);
  const Picture picture = swarm.PictureAt(0);
  Tracking tracking(settings);
  const View view = tracking.Locate(Detector().Detect(picture));
  EXPECT_EQ(view.seen.size(), 12u);
  const auto svg = AnnotatedSvg(picture, settings, view);
  ASSERT_TRUE(svg.ok()) << svg.error();
  for (const char* text : {">radio-a 7</text>", ">503</text>", ">x = 1 m</text>",
                           "floor tags 6 of 6", "robots 12 of 12"}) {
    EXPECT_NE(svg.value().find(text), std::string::npos) << text;
  }
  // The picture is inside: but for what is drawn over it, the pixels are the same.
  const Picture drawn = Drawn(svg.value());
  ASSERT_EQ(drawn.levels.size(), picture.levels.size());
  size_t same = 0;
  for (size_t i = 0; i < drawn.levels.size(); ++i) {
    if (std::abs(drawn.levels[i] - picture.levels[i]) <= 2) {
      ++same;
    }
  }
  EXPECT_GT(same, picture.levels.size() * 9 / 10);
  EXPECT_LT(same, picture.levels.size());
  const View none = Tracking(settings).Locate({});
  EXPECT_NE(AnnotatedSvg(picture, settings, none).value().find("0 floor tags were seen"),
            std::string::npos);
}

}  // namespace
}  // namespace pheromone::tracker
