// A figure of a raster as SVG, for a paper: axes in metres, a colour scale with its unit, a legend.
//
//   Result<std::string> svg = MapToSvg(raster, {.title = "trail", .maximum = 1});
//
// The cells are an embedded PNG, so that a large map stays a small file.
#pragma once

#include <string>

#include "server/base/result.h"
#include "server/formats/maps/colour_map.h"
#include "server/formats/maps/raster.h"

namespace pheromone::ctl {

struct MapSvgStyle {
  std::string title;
  std::string scale_label;  ///< of the colours: what, and its unit
  double maximum = 1;       ///< of the scale, which begins at 0
  maps::Rgb obstacle;       ///< the colour of unknown values
  int pixels_per_cell = 1;
};

/// `raster` has a cell_um. Fails if the picture would be too large (maps::EncodePicture).
Result<std::string> MapToSvg(const maps::Raster& raster, const MapSvgStyle& style);

}  // namespace pheromone::ctl
