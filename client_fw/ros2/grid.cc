#include "client_fw/ros2/grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include <boost/json/array.hpp>
#include <boost/json/serialize.hpp>

#include "client_fw/ros2/text.h"
#include "server/formats/maps/npy.h"
#include "server/formats/ros/names.h"
#include "server/operators/ctl/json_read.h"

namespace pheromone::ros2 {
namespace {

namespace json = boost::json;

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

Result<Grid> ReadGrid(const json::value& facts, std::string_view npy) {
  const json::array& origin = ctl::ItemsAt(facts, "origin_m");
  const double cell_m = ctl::NumberAt(facts, "cell_m");
  const double maximum = ctl::NumberAt(facts, "maximum");
  const bool pheromone = !ctl::At(facts, "maximum").is_null();
  if (origin.size() != 2 || !(cell_m > 0) || (pheromone && !(maximum > 0))) {
    return Error{fmt::format(
        "the server's raster: {}, expected origin_m, and a cell_m and a maximum above 0",
        json::serialize(facts))};
  }
  PHEROMONE_TRY(const maps::Raster raster, maps::ParseNpy(npy, "the server's raster"));
  Grid grid{static_cast<uint32_t>(raster.columns),
            static_cast<uint32_t>(raster.rows),
            NumberOf(origin[0]),
            NumberOf(origin[1]),
            cell_m,
            std::vector<int8_t>(raster.values.size())};
  std::transform(raster.values.begin(), raster.values.end(), grid.cells.begin(),
                 [&](double value) -> int8_t {
                   if (!pheromone) {
                     return value != 0 ? ros::kObstacle : int8_t{0};
                   }
                   return std::isnan(value) ? ros::kUnknown : ros::LevelOf(value / maximum);
                 });
  return grid;
}

}  // namespace pheromone::ros2
