#include "server/formats/maps/csv_grid.h"

#include <gtest/gtest.h>

#include "server/formats/maps/testing/rasters.h"

namespace pheromone::maps {
namespace {

using testing::ErrorOf;
using testing::kNaN;
using testing::RasterOf;
using testing::Rows;
using testing::RowsOf;

std::string GridError(std::string_view bytes) {
  return ErrorOf(ParseCsvGrid(bytes, "a.csv"));
}

TEST(CsvGrid, TheFirstLineIsTheTopRow) {
  const auto grid = ParseCsvGrid("1,2,3\n4,5,6\n7,8,9\n", "a");
  ASSERT_TRUE(grid.ok()) << grid.error();
  EXPECT_EQ(RowsOf(grid.value()), (Rows{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
  EXPECT_EQ(grid.value().At(0, 0), 7);
}

TEST(CsvGrid, WhatSpreadsheetsAndPeopleWriteIsUnderstood) {
  const auto grid =
      ParseCsvGrid("\xEF\xBB\xBF# trail, 12 May\r\n 1 ,\t-2.5\r\n\r\n1e3,.5\n   \n# end", "a");
  ASSERT_TRUE(grid.ok()) << grid.error();
  EXPECT_EQ(RowsOf(grid.value()), (Rows{{1, -2.5}, {1000, 0.5}}));
}

TEST(CsvGrid, WhatIsNotKnownIsNan) {
  const auto grid = ParseCsvGrid("nan,1", "a");
  ASSERT_TRUE(grid.ok()) << grid.error();
  EXPECT_TRUE(testing::Same(grid.value(), RasterOf({{kNaN, 1}})));
  EXPECT_EQ(EncodeCsvGrid(RasterOf({{kNaN, -kNaN}})), "nan,nan\n");
}

TEST(CsvGrid, IsWrittenInTheFewestDigitsThatComeBackExactly) {
  EXPECT_EQ(EncodeCsvGrid(RasterOf({{0.1, 2}, {-3, 1e-7}})), "0.1,2\n-3,1e-07\n");
  const Raster raster = RasterOf({{1.0 / 3, std::nextafter(1, 2)}, {1e308, 5e-324}});
  const auto back = ParseCsvGrid(EncodeCsvGrid(raster), "a");
  ASSERT_TRUE(back.ok()) << back.error();
  EXPECT_TRUE(testing::Same(back.value(), raster));
}

TEST(CsvGrid, ErrorsSayWhereAndWhat) {
  EXPECT_EQ(GridError(""), "a.csv:1: found nothing, expected rows of numbers");
  EXPECT_EQ(GridError("# only\n\n"), "a.csv:1: found nothing, expected rows of numbers");
  EXPECT_EQ(GridError("1,2\n3,x\n"), "a.csv:2:3: found \"x\", expected a number");
  EXPECT_EQ(GridError("1,2\n3,\n"), "a.csv:2:3: found \"\", expected a number");
  EXPECT_EQ(GridError("1 2\n"), "a.csv:1:1: found \"1 2\", expected a number");
  EXPECT_EQ(GridError("inf"), "a.csv:1:1: found \"inf\", expected a number");
  EXPECT_EQ(GridError("1e999"), "a.csv:1:1: found \"1e999\", expected a number");
  EXPECT_EQ(GridError("1,2\n\n3\n"), "a.csv:3: found 1 numbers, expected 2 as in the first row");
  EXPECT_EQ(GridError("1,2\n3,4,5\n"), "a.csv:2:5: found more numbers, expected 2 on this line");
}

TEST(CsvGrid, GrowsNoLargerThanARasterMay) {
  std::string wide = "1";
  for (int i = 1; i < 30'000; ++i) {
    wide += ",1";
  }
  EXPECT_TRUE(ParseCsvGrid(wide, "a").ok());
  EXPECT_EQ(GridError(wide + ",1"),
            "a.csv:1:60001: found more numbers, expected 30000 on this line");
  std::string tall;
  for (int i = 0; i < 30'001; ++i) {
    tall += "1\n";
  }
  EXPECT_EQ(GridError(tall).substr(0, 45), "a.csv:30001: found 1 columns and 30001 rows, ");
}

}  // namespace
}  // namespace pheromone::maps
