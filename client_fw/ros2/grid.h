// The server's rasters as ROS 2 has maps: nav_msgs/OccupancyGrid, whose rows go upwards from the
// origin, while the server's first row is the top one.
//
//   Result<Grid> grid = ReadGrid(json);        // of /api/v1/field, or of /api/v1/obstacles
//   grid.value().Fill("map", &message);        // which points into the grid
//
// Pheromones are 0 to 98 of their maximum, so that a viewer's palette for costs has room for its
// two special values, and -1, unknown, where an obstacle is. Obstacles are 0 or 100.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <boost/json/value.hpp>

#include "client_fw/ros2/message_kinds.h"
#include "server/base/result.h"

namespace pheromone::ros2 {

constexpr int kFullLevel = 98;
constexpr int8_t kObstacle = 100;
constexpr int8_t kUnknown = -1;

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

/// Error: not such an answer.
Result<Grid> ReadGrid(const boost::json::value& raster);

}  // namespace pheromone::ros2
