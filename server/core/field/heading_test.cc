#include "server/core/field/heading.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pheromone::field {
namespace {

TEST(DirectionOf, IsTheRoundedSineAndCosineForEveryHeading) {
  long double closest_to_a_half = 1;
  for (int heading = 0; heading < 65536; ++heading) {
    const long double angle = 2 * std::numbers::pi_v<long double> * heading / 65536;
    const long double cosine = 16384 * std::cos(angle);
    const long double sine = 16384 * std::sin(angle);
    const DirectionQ14 direction = DirectionOf(static_cast<uint16_t>(heading));
    ASSERT_EQ(direction.cos, std::llround(cosine)) << heading;
    ASSERT_EQ(direction.sin, std::llround(sine)) << heading;
    const long double half = std::abs(std::abs(sine - std::floor(sine)) - 0.5L);
    closest_to_a_half = std::min(closest_to_a_half, half);
  }
  // No entry is so near to a half that the precision of whoever computes the table could matter.
  EXPECT_GT(closest_to_a_half, 1e-7L);
}

TEST(DirectionOf, IsExactOnTheAxes) {
  EXPECT_EQ(DirectionOf(0).cos, 16384);
  EXPECT_EQ(DirectionOf(0).sin, 0);
  EXPECT_EQ(DirectionOf(16384).cos, 0);
  EXPECT_EQ(DirectionOf(16384).sin, 16384);
  EXPECT_EQ(DirectionOf(32768).cos, -16384);
  EXPECT_EQ(DirectionOf(32768).sin, 0);
  EXPECT_EQ(DirectionOf(49152).cos, 0);
  EXPECT_EQ(DirectionOf(49152).sin, -16384);
}

TEST(DirectionOf, HasEqualComponentsAtOddMultiplesOf45Degrees) {
  for (const int heading : {8192, 24576, 40960, 57344}) {
    const DirectionQ14 direction = DirectionOf(static_cast<uint16_t>(heading));
    EXPECT_EQ(std::abs(direction.cos), std::abs(direction.sin)) << heading;
  }
}

}  // namespace
}  // namespace pheromone::field
