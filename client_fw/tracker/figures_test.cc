#include "client_fw/tracker/figures.h"

#include <gtest/gtest.h>

#include "client_fw/tracker/testing/settings.h"

namespace pheromone::tracker {
namespace {

TEST(FiguresTest, TellRateMissedTagsAndErrors) {
  const Settings settings = ParseSettings(SettingsOfTheScene(), "c.toml").value();
  Figures figures(settings);
  EXPECT_EQ(figures.Line(2), "no picture");
  View view;
  view.camera = CameraFit{{}, 0.25};
  view.floor_seen = {500, 501, 502};
  view.seen.resize(2);
  view.seen[0].tag.rms_px = view.seen[1].tag.rms_px = 0.5;
  view.missed = {settings.robots[6]};
  figures.Add(view, 0.04);
  view.missed.clear();
  figures.Add(view, 0.06);
  EXPECT_EQ(figures.Line(4),
            "0.5 pictures/s, 50 ms each; a picture has 3.0 of 6 floor tags, 2.0 of 12 robots; "
            "camera 0.25 px, robots 0.50 px; missed most: tag 7, 50 %");
  figures.Clear();
  view.moved = true;
  view.seen[0].place = {1, 2};
  figures.Add(view, 0.04);
  figures.AddError(view.seen[0], {{1.003, 2.004}, 6.283185307179586});
  EXPECT_EQ(figures.Line(1),
            "1.0 pictures/s, 40 ms each; a picture has 3.0 of 6 floor tags, 2.0 of 12 robots; "
            "camera 0.25 px, robots 0.50 px; errors: median 5.0 mm, 0.00 degrees; the camera or a "
            "floor tag was moved");
}

}  // namespace
}  // namespace pheromone::tracker
