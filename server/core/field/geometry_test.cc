#include "server/core/field/geometry.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pheromone::field {
namespace {

MapGeometry TenMetres() {
  return {.origin = {0, 0}, .width_um = 10'000'000, .height_um = 5'000'000, .cell_um = 100'000};
}

TEST(MapGeometry, HasANodeAtEachMultipleOfTheCellIncludingBothEdges) {
  EXPECT_EQ(TenMetres().columns(), 101);
  EXPECT_EQ(TenMetres().rows(), 51);
  MapGeometry uneven = TenMetres();
  uneven.width_um = 10'050'000;
  EXPECT_EQ(uneven.columns(), 101);
}

TEST(MapGeometry, ContainsItsEdgesAndNothingBeyond) {
  const MapGeometry map = TenMetres();
  EXPECT_TRUE(map.Contains({0, 0}));
  EXPECT_TRUE(map.Contains({10'000'000, 5'000'000}));
  EXPECT_FALSE(map.Contains({-1, 0}));
  EXPECT_FALSE(map.Contains({0, -1}));
  EXPECT_FALSE(map.Contains({10'000'001, 0}));
  EXPECT_FALSE(map.Contains({0, 5'000'001}));
}

TEST(MapGeometry, ANodeIsNearestUpToHalfACellAndTiesGoUp) {
  const MapGeometry map = TenMetres();
  EXPECT_EQ(map.NearestNode({149'999, 0}), (NodeIndex{1, 0}));
  EXPECT_EQ(map.NearestNode({150'000, 0}), (NodeIndex{2, 0}));
  EXPECT_EQ(map.NearestNode({50'000, 50'000}), (NodeIndex{1, 1}));
}

TEST(MapGeometry, TiesGoUpLeftOfTheOriginOfCoordinatesToo) {
  MapGeometry map = TenMetres();
  map.origin = {-1'000'000, -1'000'000};
  EXPECT_EQ(map.NearestNode({-950'000, -950'001}), (NodeIndex{1, 0}));
}

TEST(MapGeometry, TheLastNodeServesTheRestBeforeAnUnevenEdge) {
  MapGeometry map = TenMetres();
  map.width_um = 10'090'000;
  EXPECT_EQ(map.NearestNode({10'090'000, 0}), (NodeIndex{100, 0}));
}

TEST(Division, RoundsAsItsNameSays) {
  for (int64_t divisor : {1, 2, 3, 7, 10}) {
    for (int64_t dividend = -50; dividend <= 50; ++dividend) {
      const double exact = static_cast<double>(dividend) / static_cast<double>(divisor);
      EXPECT_EQ(FloorDiv(dividend, divisor), static_cast<int64_t>(std::floor(exact)));
      EXPECT_EQ(RoundDiv(dividend, divisor), std::llround(exact)) << dividend << '/' << divisor;
    }
  }
}

}  // namespace
}  // namespace pheromone::field
