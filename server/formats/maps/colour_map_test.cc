#include "server/formats/maps/colour_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

namespace pheromone::maps {
namespace {

TEST(Viridis, HasTheColoursThatMatplotlibPublishes) {
  EXPECT_EQ(Viridis(0), (Rgb{68, 1, 84}));
  EXPECT_EQ(Viridis(0.25), (Rgb{59, 82, 139}));
  EXPECT_EQ(Viridis(0.5), (Rgb{33, 145, 140}));
  EXPECT_EQ(Viridis(0.75), (Rgb{94, 201, 98}));
  EXPECT_EQ(Viridis(1), (Rgb{253, 231, 37}));
}

TEST(Viridis, OffTheScaleHasTheColourOfThatEnd) {
  EXPECT_EQ(Viridis(-1e300), Viridis(0));
  EXPECT_EQ(Viridis(1e300), Viridis(1));
  EXPECT_EQ(Viridis(std::numeric_limits<double>::infinity()), Viridis(1));
  EXPECT_EQ(Viridis(std::numeric_limits<double>::quiet_NaN()), Viridis(0));
}

// CIE 1976 L* of an sRGB colour (IEC 61966-2-1, D65).
double Lightness(Rgb colour) {
  const auto linear = [](uint8_t level) {
    const double share = level / 255.0;
    return share <= 0.04045 ? share / 12.92 : std::pow((share + 0.055) / 1.055, 2.4);
  };
  const double y =
      0.2126 * linear(colour.red) + 0.7152 * linear(colour.green) + 0.0722 * linear(colour.blue);
  return y > 216.0 / 24389 ? 116 * std::cbrt(y) - 16 : y * 24389 / 27;
}

// What makes it readable in gray print, and what a slip in the table would break.
TEST(Viridis, GrowsLighterInProportion) {
  const double dark = Lightness(Viridis(0));
  const double light = Lightness(Viridis(1));
  for (int i = 0; i < 256; ++i) {
    EXPECT_NEAR(Lightness(Viridis(i / 256.0)), dark + (light - dark) * i / 255, 2) << i;
  }
}

TEST(Viridis, HasNoVisibleSteps) {
  for (int i = 1; i < 256; ++i) {
    const Rgb before = Viridis((i - 1) / 256.0);
    const Rgb after = Viridis(i / 256.0);
    EXPECT_LE(std::abs(before.red - after.red), 4) << i;
    EXPECT_LE(std::abs(before.green - after.green), 4) << i;
    EXPECT_LE(std::abs(before.blue - after.blue), 4) << i;
  }
}

}  // namespace
}  // namespace pheromone::maps
