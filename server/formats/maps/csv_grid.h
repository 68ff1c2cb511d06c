// Numbers as text, for spreadsheets and numpy.loadtxt(delimiter=','). Two kinds of file:
//
//   1, 0.5, 0        a grid: a line is a row of cells, the first line the top row
//   2, 0.25, nan
//
//   x,y,value        places: a header, then the coordinates in metres and a value on each line
//   0.05,1.2,3
//
// Numbers as in C, always with a decimal point, regardless of the locale; `nan` for unknown values.
// Blanks around numbers, empty lines, CR LF, a UTF-8 byte order mark and lines that begin with #
// are allowed.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/core/field/geometry.h"
#include "server/formats/maps/raster.h"

namespace pheromone::maps {

/// `name` is the file's name in errors: `name:line:column: ...`.
Result<Raster> ParseCsvGrid(std::string_view bytes, std::string_view name);
Result<Raster> LoadCsvGrid(const std::string& path);

/// Each number in the fewest digits that give the same double again.
std::string EncodeCsvGrid(const Raster& raster);
Status SaveCsvGrid(const std::string& path, const Raster& raster);

struct PlacedValue {
  field::PointUm place;
  double value = 0;
  bool operator==(const PlacedValue&) const = default;
};

/// Positions are rounded to the nearest micrometre; they are within 1000 km of the origin.
Result<std::vector<PlacedValue>> ParseCsvPlaces(std::string_view bytes, std::string_view name);
Result<std::vector<PlacedValue>> LoadCsvPlaces(const std::string& path);

std::string EncodeCsvPlaces(const std::vector<PlacedValue>& places);
Status SaveCsvPlaces(const std::string& path, const std::vector<PlacedValue>& places);

}  // namespace pheromone::maps
