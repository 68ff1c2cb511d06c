// Rasters in files of any format of server/formats/maps, selected by the extension: .pgm, .png
// (gray), .npy, .csv (a grid), .yaml or .yml (a ROS map: occupancy in percent).
//
//   Result<maps::Raster> raster = LoadRaster("lab.png", std::nullopt);
//   Status saved = SaveRaster("lab.npy", std::move(raster).value(), {});
//
// Values are not changed unless requested: a value that a format cannot represent is an error.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/base/result.h"
#include "server/formats/maps/raster.h"

namespace pheromone::ctl {

/// Whether the extension is one of the above; the error lists them.
Status CheckRasterEnding(const std::string& path);

/// `white` is the value of white in an image; empty: its largest level.
Result<maps::Raster> LoadRaster(const std::string& path, std::optional<double> white);

struct RasterStyle {
  std::optional<double> white;  ///< the value of white; empty: values are levels, and must be whole
  std::optional<int64_t> cell_um;  ///< for .yaml, if unknown to the raster
};
Status SaveRaster(const std::string& path, maps::Raster raster, const RasterStyle& style);

}  // namespace pheromone::ctl
