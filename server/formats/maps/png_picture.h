// PNG: reads and writes gray images, and draws rasters in colour.
//
//   Result<GrayImage> map = LoadPng("lab.png");
//   Status drawn = SavePicture("trail.png", raster, {.low = 0, .high = 12.5});
//
// Any kind of PNG is read: 1 to 16 bits, gray, palette or RGB, interlaced or not. A colour becomes
// the mean of its channels, as in ROS; a pixel that is not fully opaque becomes NaN, that is
// unknown. Gamma and colour profiles are ignored. Reading an interlaced image needs up to 8 bytes
// per pixel in addition to the raster.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/formats/maps/colour_map.h"
#include "server/formats/maps/raster.h"

namespace pheromone::maps {

/// Levels are up to 65 535 if the file has 16 bits a channel, otherwise up to 255. Errors are
/// `name: byte N: ...`, the position up to which it was read.
Result<GrayImage> ParsePng(std::string_view bytes, std::string_view name);
Result<GrayImage> LoadPng(const std::string& path);

/// Gray, 16 bits if `maximum` is above 255, otherwise 8: levels are spread so that `maximum` is
/// white. Fails only if libpng does.
Result<std::string> EncodeGrayPng(const GrayImage& image);
Status SaveGrayPng(const std::string& path, const GrayImage& image);

struct PictureStyle {
  double low = 0;   ///< this value and all below are drawn in Viridis(0)
  double high = 1;  ///< > low; Viridis(1), as everything above
  Rgb unknown = {255, 255, 255};
  std::optional<Rgb> infinite = {};  ///< none: as `high`, or `low` below
  int pixels_per_cell = 1;           ///< 1 or more; each cell is a square of that side
};

/// 8-bit RGB. Fails if the picture would have a SizeProblem.
Result<std::string> EncodePicture(const Raster& raster, const PictureStyle& style);
Status SavePicture(const std::string& path, const Raster& raster, const PictureStyle& style);

}  // namespace pheromone::maps
