#include "client_fw/ros2/grid.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <boost/json/parse.hpp>

namespace pheromone::ros2 {
namespace {

// Of float64 in C order, the top row first (NumPy's format 1.0).
std::string NpyOf(int rows, int columns, const std::vector<double>& values) {
  std::string header =
      fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}), }}", rows, columns);
  header += std::string(64 - (10 + header.size() + 1) % 64, ' ') + '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() & 0xFF);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  for (const double value : values) {
    for (int i = 0; i < 64; i += 8) {
      bytes += static_cast<char>(std::bit_cast<uint64_t>(value) >> i & 0xFF);
    }
  }
  return bytes;
}

Result<Grid> ReadText(const std::string& facts, const std::string& npy) {
  return ReadGrid(boost::json::parse(facts), npy);
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Grid, RowsGoUpwardsAndLevelsToNinetyEight) {
  Grid grid = ReadText(R"({"maximum": 2, "columns": 3, "rows": 2, "origin_m": [-1, 0.5],
                       "cell_m": 0.25})",
                       NpyOf(2, 3, {0, 1, 2, kNan, 0.01, 3}))
                  .value();
  EXPECT_EQ(grid.cells, (std::vector<int8_t>{-1, 1, 98, 0, 49, 98}));
  OccupancyGrid message;
  const std::string frame = "map";
  grid.Fill(frame, &message);
  EXPECT_EQ(std::string(message.header.frame_id), "map");
  EXPECT_GT(message.header.stamp.sec, 0);
  EXPECT_EQ(message.info.width, 3u);
  EXPECT_EQ(message.info.height, 2u);
  EXPECT_EQ(message.info.resolution, 0.25f);
  EXPECT_EQ(message.info.origin.position.x, -1);
  EXPECT_EQ(message.info.origin.position.y, 0.5);
  EXPECT_EQ(message.info.origin.orientation.w, 1);
  EXPECT_EQ(message.data._length, 6u);
  EXPECT_EQ(message.data._buffer[5], 98);
}

TEST(Grid, ObstaclesAreAHundred) {
  EXPECT_EQ(ReadText(R"({"origin_m": [0, 0], "cell_m": 1})", NpyOf(1, 2, {1, 0})).value().cells,
            (std::vector<int8_t>{100, 0}));
}

TEST(Grid, WhatIsNoRasterIsAnError) {
  const std::string one = NpyOf(1, 1, {1});
  ASSERT_TRUE(ReadText(R"({"origin_m": [0, 0], "cell_m": 1})", one).ok());
  for (const char* facts :
       {"null", "{}", R"({"origin_m": [0, 0], "cell_m": 0})", R"({"origin_m": [0], "cell_m": 1})",
        R"({"maximum": 0, "origin_m": [0, 0], "cell_m": 1})"}) {
    EXPECT_FALSE(ReadText(facts, one).ok()) << facts;
  }
  EXPECT_FALSE(ReadText(R"({"origin_m": [0, 0], "cell_m": 1})", "").ok());
  EXPECT_FALSE(
      ReadText(R"({"origin_m": [0, 0], "cell_m": 1})", one.substr(0, one.size() - 1)).ok());
}

}  // namespace
}  // namespace pheromone::ros2
