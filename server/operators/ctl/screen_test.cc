#include "server/operators/ctl/screen.h"

#include <gtest/gtest.h>

namespace pheromone::ctl {
namespace {

// 3 x 4 cells of 1 m from (10, 20): full, half, an obstacle; nothing; one below the half.
MapPicture SmallPicture() {
  MapPicture picture;
  picture.columns = 3;
  picture.rows = 4;
  picture.values = {2.0, 1.0, std::nullopt,  // y = 23
                    0.0, 0.0, std::nullopt,  // y = 22
                    0.0, 0.0, 0.0,           // y = 21
                    0.0, 0.0, 0.01};         // y = 20
  picture.maximum = 2;
  picture.left_m = 10;
  picture.bottom_m = 20;
  return picture;
}

TEST(ScreenTest, WithoutColoursACharacterShowsTheStrongerOfItsTwoCells) {
  EXPECT_EQ(Draw(SmallPicture(), {}, Colours::kNone), "@=#\n  .\n");
}

TEST(ScreenTest, RobotsAreArrowsWithTheirNumbersWhereTheyAre) {
  MapPicture picture = SmallPicture();
  picture.markers = {{10.5, 21.5, 90, "7"}, {12.5, 23.9, 180, "12"}, {13.5, 20, 0, "off"}};
  EXPECT_EQ(Draw(picture, {}, Colours::kNone), "@=\u2190\n\u21917.\n");
}

TEST(ScreenTest, HalfBlocksHaveTheUpperCellsColourOnTheLowerOnes) {
  MapPicture picture;
  picture.columns = 2;
  picture.rows = 2;
  picture.values = {1.0, 1.0, 0.0, std::nullopt};
  // Viridis ends in (253, 231, 37) and begins with (68, 1, 84); obstacles are gray.
  EXPECT_EQ(Draw(picture, {}, Colours::k24Bit),
            "\x1b[38;2;253;231;37m\x1b[48;2;68;1;84m\u2580"
            "\x1b[38;2;253;231;37m\x1b[48;2;128;128;128m\u2580\x1b[0m\n");
  // In the cube: 16 + 36 r + 6 g + b with steps at 0, 95, 135, 175, 215, 255.
  EXPECT_EQ(Draw(picture, {}, Colours::k256),
            "\x1b[38;5;220m\x1b[48;5;53m\u2580\x1b[38;5;220m\x1b[48;5;102m\u2580\x1b[0m\n");
}

TEST(ScreenTest, NothingIsDrawnBeyondTheScreenOrBelowAnOddRow) {
  MapPicture picture = SmallPicture();
  EXPECT_EQ(Draw(picture, {2, 1}, Colours::kNone), "@=\n");
  picture.rows = 3;
  EXPECT_EQ(Draw(picture, {}, Colours::kNone), "@=#\n   \n");
  EXPECT_EQ(Draw(MapPicture(), {}, Colours::k24Bit), "");
  picture.values.clear();  // an answer that is cut short
  EXPECT_EQ(Draw(picture, {}, Colours::kNone), "###\n###\n");
}

TEST(ScreenTest, CellsAreAsFineAsTheScreenAllows) {
  EXPECT_EQ(NodesPerCell(101, 101, {80, 40}), 2);  // 101 / 80, 101 / 80
  EXPECT_EQ(NodesPerCell(101, 101, {101, 51}), 1);
  EXPECT_EQ(NodesPerCell(101, 101, {100, 51}), 2);
  EXPECT_EQ(NodesPerCell(20'000, 100, {80, 22}), 250);
  EXPECT_EQ(NodesPerCell(1, 1, {0, -3}), 1);
}

TEST(ScreenTest, ArrowsPointToTheNearestEighth) {
  EXPECT_EQ(ArrowOf(22), "\u2192");
  EXPECT_EQ(ArrowOf(23), "\u2197");
  EXPECT_EQ(ArrowOf(-90), "\u2193");
  EXPECT_EQ(ArrowOf(359), "\u2192");
  EXPECT_EQ(ArrowOf(-3600 + 135), "\u2196");
}

}  // namespace
}  // namespace pheromone::ctl
