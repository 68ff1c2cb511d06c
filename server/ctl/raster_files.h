// Rasters in files of any format that server/maps has, told by the file's ending: .pgm, .png
// (gray), .npy, .csv (a grid), .yaml or .yml (a ROS map: occupancy in percent).
//
//   Result<maps::Raster> raster = LoadRaster("lab.png", std::nullopt);
//   Status saved = SaveRaster("lab.npy", std::move(raster).value(), {});
//
// Nothing is changed on the way without being asked for: what a format cannot hold is an error.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/base/result.h"
#include "server/maps/raster.h"

namespace pheromone::ctl {

/// Whether the ending is one of the above; with the list of them if not.
Status CheckRasterEnding(const std::string& path);

/// `white` is the value that white stands for in a picture; nothing: its own largest level.
Result<maps::Raster> LoadRaster(const std::string& path, std::optional<double> white);

struct RasterStyle {
  std::optional<double> white;     ///< drawn white; nothing: values are levels, and must be whole
  std::optional<int64_t> cell_um;  ///< for .yaml, if the raster does not know
};
Status SaveRaster(const std::string& path, maps::Raster raster, const RasterStyle& style);

}  // namespace pheromone::ctl
