#include "client_fw/ros2/grid.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <boost/json/parse.hpp>

namespace pheromone::ros2 {
namespace {

Result<Grid> ReadText(const std::string& text) {
  return ReadGrid(boost::json::parse(text));
}

TEST(Grid, RowsGoUpwardsAndLevelsToNinetyEight) {
  Grid grid = ReadText(R"({"maximum": 2, "columns": 3, "rows": 2, "origin_m": [-1, 0.5],
                       "cell_m": 0.25, "values": [[0, 1, 2], [null, 0.01, 3]]})")
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
  EXPECT_EQ(ReadText(R"({"columns": 2, "rows": 1, "origin_m": [0, 0], "cell_m": 1,
                     "values": [[1, 0]]})")
                .value()
                .cells,
            (std::vector<int8_t>{100, 0}));
}

TEST(Grid, WhatIsNoRasterIsAnError) {
  for (const char* text :
       {"null", "{}", R"({"columns": 2, "rows": 1, "origin_m": [0, 0], "cell_m": 1, "values": []})",
        R"({"columns": 2, "rows": 1, "origin_m": [0, 0], "cell_m": 1, "values": [[1]]})",
        R"({"columns": 1, "rows": 1, "origin_m": [0, 0], "cell_m": 0, "values": [[1]]})",
        R"({"columns": 1, "rows": 1, "origin_m": [0], "cell_m": 1, "values": [[1]]})",
        R"({"columns": 1e18, "rows": 1e18, "origin_m": [0, 0], "cell_m": 1, "values": [[1]]})",
        R"({"maximum": 0, "columns": 1, "rows": 1, "origin_m": [0, 0], "cell_m": 1,
            "values": [[1]]})"}) {
    EXPECT_FALSE(ReadText(text).ok()) << text;
  }
}

}  // namespace
}  // namespace pheromone::ros2
