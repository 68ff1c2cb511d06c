// Arrays as NumPy's .npy: a two-dimensional array of numbers is a raster, its first row the top.
// Format: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html, versions 1.0, 2.0
//
//   numpy.save("trail.npy", a)          a: bool, integers of 8 to 64 bits, float32, float64
//   Result<Raster> trail = LoadNpy("trail.npy");
//
// Either byte order, C or Fortran order. A 64-bit integer that a double cannot represent is an
// error.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/formats/maps/raster.h"

namespace pheromone::maps {

/// `name` is the file's name in errors: `name: byte N: ...`.
Result<Raster> ParseNpy(std::string_view bytes, std::string_view name);
Result<Raster> LoadNpy(const std::string& path);

/// Version 1.0, C order, little-endian float64 ('<f8'): every value bit for bit, including NaN.
std::string EncodeNpy(const Raster& raster);

Status SaveNpy(const std::string& path, const Raster& raster);

/// A file of many rasters of one size, an array (rasters, rows, columns), that may grow: the
/// header, of as many bytes for any number, and then the values of each raster.
std::string NpyStackHeader(uint64_t rasters, const Raster& raster);
std::string NpyValues(const Raster& raster);

}  // namespace pheromone::maps
