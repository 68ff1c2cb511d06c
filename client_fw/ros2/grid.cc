#include "client_fw/ros2/grid.h"

#include <fmt/format.h>

#include <cstddef>

#include <boost/json/array.hpp>

#include "client_fw/ros2/text.h"
#include "server/formats/ros/names.h"
#include "server/operators/ctl/json_read.h"

namespace pheromone::ros2 {
namespace {

namespace json = boost::json;

constexpr uint64_t kMaxCells = 4'000'000;

double NumberOf(const json::value& value) {
  return value.is_number() ? value.to_number<double>() : 0;
}

}  // namespace

void Grid::Fill(const std::string& frame, OccupancyGrid* message) {
  *message = {};
  message->header = MakeHeader(frame);
  message->info.map_load_time = message->header.stamp;
  message->info.resolution = static_cast<float>(cell_m);
  message->info.width = columns;
  message->info.height = rows;
  message->info.origin = {{x_m, y_m, 0}, {0, 0, 0, 1}};
  PointAt(&message->data, &cells);
}

Result<Grid> ReadGrid(const json::value& raster) {
  const uint64_t columns = ctl::CountAt(raster, "columns");
  const uint64_t rows = ctl::CountAt(raster, "rows");
  const json::array& values = ctl::ItemsAt(raster, "values");
  const json::array& origin = ctl::ItemsAt(raster, "origin_m");
  const double cell_m = ctl::NumberAt(raster, "cell_m");
  const double maximum = ctl::NumberAt(raster, "maximum");
  const bool pheromone = !ctl::At(raster, "maximum").is_null();
  if (columns == 0 || rows == 0 || columns > kMaxCells / rows || values.size() != rows ||
      origin.size() != 2 || !(cell_m > 0) || (pheromone && !(maximum > 0))) {
    return Error{
        fmt::format("the server's raster: {} x {} cells, {} rows of values, expected up to {} "
                    "cells, and a cell_m and a maximum above 0",
                    columns, rows, values.size(), kMaxCells)};
  }
  Grid grid{static_cast<uint32_t>(columns),
            static_cast<uint32_t>(rows),
            NumberOf(origin[0]),
            NumberOf(origin[1]),
            cell_m,
            std::vector<int8_t>(columns * rows)};
  for (size_t i = 0; i < rows; ++i) {
    const json::array* row = values[i].if_array();
    if (row == nullptr || row->size() != columns) {
      return Error{fmt::format("the server's raster: row {} has {} values, expected {}", i,
                               row == nullptr ? 0 : row->size(), columns)};
    }
    for (size_t j = 0; j < columns; ++j) {
      const json::value& value = (*row)[j];
      int8_t& cell = grid.cells[(rows - 1 - i) * columns + j];
      if (!pheromone) {
        cell = NumberOf(value) != 0 ? ros::kObstacle : int8_t{0};
      } else if (value.is_null()) {
        cell = ros::kUnknown;
      } else {
        cell = ros::LevelOf(NumberOf(value) / maximum);
      }
    }
  }
  return grid;
}

}  // namespace pheromone::ros2
