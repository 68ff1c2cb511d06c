#include "server/formats/maps/raster.h"

#include <gtest/gtest.h>

#include "server/formats/maps/testing/rasters.h"

namespace pheromone::maps {
namespace {

using testing::kNaN;
using testing::RasterOf;
using testing::Rows;
using testing::RowsOf;

TEST(Raster, CountsItsRowsFromTheBottom) {
  const Raster raster = RasterOf({{1, 2, 3}, {4, 5, 6}});
  EXPECT_EQ(raster.At(0, 0), 4);
  EXPECT_EQ(raster.At(2, 1), 3);
}

TEST(Raster, ASizeIsRefusedBeforeAnythingIsAllocated) {
  EXPECT_EQ(SizeProblem(1, 1), "");
  EXPECT_EQ(SizeProblem(30'000, 2'000), "");
  EXPECT_EQ(SizeProblem(8192, 8192), "");
  EXPECT_NE(SizeProblem(8192, 8193), "");
  EXPECT_NE(SizeProblem(0, 1), "");
  EXPECT_NE(SizeProblem(1, 0), "");
  EXPECT_NE(SizeProblem(1, 30'001), "");
  EXPECT_NE(SizeProblem(uint64_t{1} << 32, uint64_t{1} << 32), "");  // the product would be 0
  EXPECT_EQ(SizeProblem(30'001, 2),
            "found 30001 columns and 2 rows, expected 1 to 30000 of each and at most 67108864 "
            "cells");
}

TEST(Raster, AValueIsThatOfTheCellAroundThePoint) {
  Raster raster = RasterOf({{1, 2}, {3, 4}});
  raster.origin = {-100, 1000};
  EXPECT_EQ(ValueAt(raster, {-100, 1000}), std::nullopt) << "the size of a cell is not known";
  raster.cell_um = 50;
  EXPECT_EQ(ValueAt(raster, {-100, 1000}), 3);
  EXPECT_EQ(ValueAt(raster, {-51, 1049}), 3);
  EXPECT_EQ(ValueAt(raster, {-50, 1049}), 4);
  EXPECT_EQ(ValueAt(raster, {-51, 1050}), 1);
  EXPECT_EQ(ValueAt(raster, {-1, 1099}), 2);
  EXPECT_EQ(ValueAt(raster, {-101, 1000}), std::nullopt);
  EXPECT_EQ(ValueAt(raster, {-100, 999}), std::nullopt);
  EXPECT_EQ(ValueAt(raster, {0, 1000}), std::nullopt);
  EXPECT_EQ(ValueAt(raster, {-100, 1100}), std::nullopt);
}

TEST(GrayImage, IsScaledSoThatWhiteIsTheMaximum) {
  const GrayImage image{RasterOf({{0, 50, 200}}), 200};
  EXPECT_EQ(RowsOf(ValuesOf(image, 8)), (Rows{{0, 2, 8}}));
  const GrayImage back = GrayOf(ValuesOf(image, 8), 8, 200);
  EXPECT_EQ(RowsOf(back.raster), (Rows{{0, 50, 200}}));
  EXPECT_EQ(back.maximum, 200);
}

TEST(GrayImage, HoldsWhatIsOffTheScaleAsBlackOrWhite) {
  const GrayImage image = GrayOf(RasterOf({{-1, kNaN, 0.4, 0.6, 10.4, 1e300}}), 10, 10);
  EXPECT_EQ(RowsOf(image.raster), (Rows{{0, 0, 0, 1, 10, 10}}));
}

}  // namespace
}  // namespace pheromone::maps
