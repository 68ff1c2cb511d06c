// A grid of numbers as text, for spreadsheets and numpy.loadtxt(delimiter=','): a line is a row of
// cells, the first line the top row.
//
//   1, 0.5, 0
//   2, 0.25, nan
//
// Numbers as in C, always with a decimal point, regardless of the locale; `nan` for unknown values.
// Blanks around numbers, empty lines, CR LF, a UTF-8 byte order mark and lines that begin with #
// are allowed.
#pragma once

#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/formats/maps/raster.h"

namespace pheromone::maps {

/// `name` is the file's name in errors: `name:line:column: ...`.
Result<Raster> ParseCsvGrid(std::string_view bytes, std::string_view name);
Result<Raster> LoadCsvGrid(const std::string& path);

/// Each number in the fewest digits that give the same double again.
std::string EncodeCsvGrid(const Raster& raster);
Status SaveCsvGrid(const std::string& path, const Raster& raster);

}  // namespace pheromone::maps
