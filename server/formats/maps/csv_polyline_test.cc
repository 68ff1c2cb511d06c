#include "server/formats/maps/csv_polyline.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::maps {
namespace {

std::vector<Polyline> Parse(std::string_view text) {
  const auto lines = ParseCsvLines(text, "course.csv");
  EXPECT_TRUE(lines.ok()) << lines.error();
  return lines.ok() ? lines.value() : std::vector<Polyline>();
}

std::string ErrorOf(std::string_view text) {
  const auto lines = ParseCsvLines(text, "course.csv");
  return lines.ErrorOr("no error");
}

TEST(CsvLine, RowsArePointsInMetresAndAnEmptyRowBeginsANewLine) {
  EXPECT_EQ(Parse("x_m,y_m\n0.5,1.25\n4,1.25\n\n4,2\n4,6.5\n"),
            (std::vector<Polyline>{{{{500'000, 1'250'000}, {4'000'000, 1'250'000}}, false},
                                   {{{4'000'000, 2'000'000}, {4'000'000, 6'500'000}}, false}}));
}

TEST(CsvLine, CommaSemicolonAndTabSeparateAlike) {
  const std::vector<Polyline> expected = {
      {{{1'000'000, -2'000'000}, {500'000, 30'000'000}}, false}};
  EXPECT_EQ(Parse("1,-2\n.5,3e1\n"), expected);
  EXPECT_EQ(Parse("x;y\n1;-2\n.5;3e1\n"), expected);
  EXPECT_EQ(Parse("x\ty\n1\t-2\n.5\t3e1\n"), expected);
  EXPECT_EQ(Parse(" 1 , -2 \n +.5 , +3e1 "), expected);
}

TEST(CsvLine, CommentsAndLineEndsOfOtherSystemsDoNotMatter) {
  EXPECT_EQ(Parse("\xEF\xBB\xBF# a course\r\nx,y\r\n1,2 # start\r\n  # not an empty row\r\n3,4"),
            (std::vector<Polyline>{{{{1'000'000, 2'000'000}, {3'000'000, 4'000'000}}, false}}));
}

TEST(CsvLine, ALineThatEndsWhereItBeganIsClosed) {
  EXPECT_EQ(Parse("0,0\n1,0\n1,1\n0,0\n"),
            (std::vector<Polyline>{{{{0, 0}, {1'000'000, 0}, {1'000'000, 1'000'000}}, true}}));
}

TEST(CsvLine, CoordinatesAreRoundedToTheNearestMicrometreAndRepeatedPointsTakenOnce) {
  EXPECT_EQ(Parse("0.0000014,-0.0000016\n0.0000012,-0.000002\n1,1\n"),
            (std::vector<Polyline>{{{{1, -2}, {1'000'000, 1'000'000}}, false}}));
}

TEST(CsvLine, ASinglePointIsALine) {
  EXPECT_EQ(Parse("7,8"), (std::vector<Polyline>{{{{7'000'000, 8'000'000}}, false}}));
}

TEST(CsvLine, AnErrorNamesPlaceFoundAndExpected) {
  EXPECT_EQ(ErrorOf("1,2\n3,4m\n"),
            "course.csv:2:3: found \"4m\", expected a number of metres with a decimal point, such "
            "as -1.25");
  EXPECT_EQ(ErrorOf("# c\n\n 12\n"),
            "course.csv:3:2: found \"12\", expected two columns, x and y in metres");
  EXPECT_EQ(ErrorOf("1,2,3"),
            "course.csv:1:3: found \"1,2,3\", expected two columns, x and y in metres");
  EXPECT_EQ(ErrorOf("1,5;2,5"),
            "course.csv:1:1: found \"1,5\", expected a number of metres with a decimal point, such "
            "as -1.25");
  EXPECT_EQ(ErrorOf("1,2\n\n3,1000001\n"),
            "course.csv:3:1: found a point at x = 3 m, y = 1000001 m, expected coordinates of at "
            "most 1000 km");
}

TEST(CsvLine, WhatIsNoFiniteDecimalNumberIsRefused) {
  for (const char* number : {"nan", "inf", "-inf", "0x10", "1e999", "", "+", "+-1", "--1", "1 2"}) {
    EXPECT_NE(ErrorOf(std::string(number) + ",1\n1,1\n"), "no error") << number;
    EXPECT_NE(ErrorOf("1,1\n2," + std::string(number) + "\n"), "no error") << number;
  }
}

TEST(CsvLine, AHeaderIsTakenOnlyInTheFirstRow) {
  EXPECT_NE(ErrorOf("1,2\nx,y\n"), "no error");
  EXPECT_NE(ErrorOf("y,x\n1,2\n"), "no error");
}

TEST(CsvLine, AFileWithoutPointsIsAnError) {
  EXPECT_EQ(ErrorOf(""), "course.csv:1:1: found no line, expected at least one");
  EXPECT_EQ(ErrorOf("x,y\n\n# nothing\n"), "course.csv:1:1: found no line, expected at least one");
}

TEST(CsvLine, AMillionPointsAreReadAndOneMoreIsNot) {
  std::string text;
  for (size_t i = 0; i < kMaxPolylinePoints; ++i) {
    text += i % 2 == 0 ? "0,0\n" : "1,1\n";
  }
  EXPECT_EQ(Parse(text).at(0).points.size(), kMaxPolylinePoints);
  EXPECT_EQ(ErrorOf(text + "0,0"),
            "course.csv:1000001:1: found more than 1000000 points, expected shorter lines or a "
            "coarser tolerance");
}

}  // namespace
}  // namespace pheromone::maps
