// Gray images as PGM, netpbm's format: P5 (binary) and P2 (text), up to 65 535 levels. Format:
// https://netpbm.sourceforge.net/doc/pgm.html
//
//   P5 3 2 255 <6 bytes>
//
// One image per file; a file with more bytes than its header declares is refused.
#pragma once

#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/formats/maps/raster.h"

namespace pheromone::maps {

/// Errors are `name:line:column: ...` in the header and in P2, `name: byte N: ...` in P5.
Result<GrayImage> ParsePgm(std::string_view bytes, std::string_view name);
Result<GrayImage> LoadPgm(const std::string& path);

/// P5; two bytes per pixel if `maximum` is above 255. Each value becomes its NearestLevel.
std::string EncodePgm(const GrayImage& image);
Status SavePgm(const std::string& path, const GrayImage& image);

}  // namespace pheromone::maps
