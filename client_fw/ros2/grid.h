// The server's rasters as ROS 2 has maps: nav_msgs/OccupancyGrid, whose rows go upwards from the
// origin. They come as arrays: to parse 512 x 512 numbers as text took most of this program's time.
//
//   Result<Grid> grid = ReadGrid(facts, npy);  // of /api/v1/field, or of /api/v1/obstacles
//   grid.value().Fill("map", &message);        // which points into the grid
//
// What cells mean is in server/formats/ros/names.h.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <boost/json/value.hpp>

#include "client_fw/ros2/message_kinds.h"
#include "server/base/result.h"

namespace pheromone::ros2 {

struct Grid {
  uint32_t columns = 0;
  uint32_t rows = 0;
  double x_m = 0;  ///< the lower left corner of the lower left cell
  double y_m = 0;
  double cell_m = 0;
  std::vector<int8_t> cells;  ///< the bottom row first

  bool operator==(const Grid&) const = default;
  /// `message` points into the grid and at `frame`, which have to outlive it.
  void Fill(const std::string& frame, OccupancyGrid* message);
};

/// `facts` say what the array is of. Error: not such an answer.
Result<Grid> ReadGrid(const boost::json::value& facts, std::string_view npy);

}  // namespace pheromone::ros2
