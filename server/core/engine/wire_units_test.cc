#include "server/core/engine/wire_units.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <random>

namespace pheromone::engine {
namespace {

TEST(NotAddressable, IsTheFirstEdgeBeyondWhatCoordinatesReach) {
  // 32.767 m with pose units of 1 mm.
  const field::MapGeometry fits = {{-32'767'000, -32'767'000}, 65'534'000, 65'534'000, 1'000};
  EXPECT_EQ(NotAddressable(fits, 100, false), std::nullopt);
  EXPECT_FALSE(NeedsWide(fits, 100));
  for (const field::MapGeometry map : {field::MapGeometry{{-32'767'001, 0}, 1'000, 1'000, 1'000},
                                       {{-32'768'001, 0}, 32'767'999, 1'000, 1'000},
                                       {{0, -32'767'001}, 1'000, 1'000, 1'000}}) {
    EXPECT_EQ(NotAddressable(map, 100, false), std::min(map.origin.x, map.origin.y));
    EXPECT_TRUE(NeedsWide(map, 100));
    EXPECT_EQ(NotAddressable(map, 100, true), std::nullopt);
  }
  EXPECT_EQ(NotAddressable({{0, 0}, 32'767'001, 1'000, 1'000}, 100, false), 32'767'001);
  EXPECT_EQ(NotAddressable({{0, 0}, 1'000, 32'767'001, 1'000}, 100, false), 32'767'001);
  EXPECT_EQ(NotAddressable({{0, 0}, 1'000, int64_t{21'474'836'470}, 1'000}, 1, true), std::nullopt);
  EXPECT_EQ(NotAddressable({{0, 0}, 1'000, int64_t{21'474'836'471}, 1'000}, 1, true),
            int64_t{21'474'836'471});
}

TEST(ToWire, CarriesWhatFitsAsItIs) {
  for (const auto& [left, right] : {std::pair{0, 0}, {32767, -32767}, {1, 32767}, {-4096, 12}}) {
    const WireIntensities p = ToWire({left, right});
    EXPECT_EQ(p.left, left);
    EXPECT_EQ(p.right, right);
  }
}

// The definition, recomputed naively for every saturated pair: floor(|P| * 32767 / max), signed.
TEST(ToWire, SaturationKeepsTheRatio) {
  std::mt19937_64 random(1);
  __extension__ using Int128 = __int128;
  for (int i = 0; i < 100'000; ++i) {
    const int bits = 17 + static_cast<int>(random() % 44);
    const int64_t left = static_cast<int64_t>(random() >> (64 - bits)) * (random() % 2 ? 1 : -1);
    const int64_t right = static_cast<int64_t>(random() >> (64 - bits)) * (random() % 2 ? 1 : -1);
    const int64_t max = std::max(std::abs(left), std::abs(right));
    if (max <= 32767) {
      continue;
    }
    const auto expected = [max](int64_t p) {
      const auto magnitude = static_cast<int64_t>(Int128{std::abs(p)} * 32767 / max);
      return p < 0 ? -magnitude : magnitude;
    };
    const WireIntensities p = ToWire({left, right});
    ASSERT_EQ(p.left, expected(left));
    ASSERT_EQ(p.right, expected(right));
    ASSERT_EQ(std::max(std::abs(p.left), std::abs(p.right)), 32767);
  }
}

TEST(ToField, ScalesByThePoseUnit) {
  EXPECT_EQ(ToMicrometres(1234, 100), 1'234'000);
  EXPECT_EQ(ToMicrometres(-5, 1), -50);
  EXPECT_EQ(ToMicrometres(INT32_MIN, 65535), int64_t{INT32_MIN} * 655'350);
  const field::PoseUm pose = ToField({-7, 9, 1000}, 100);
  EXPECT_EQ(pose.position, (field::PointUm{-7'000, 9'000}));
  EXPECT_EQ(pose.heading, 1000);
}

}  // namespace
}  // namespace pheromone::engine
