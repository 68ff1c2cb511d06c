// Polylines as a table of coordinates in metres, x,y in each row:
//
//   # the corridor, then the lab
//   x_m,y_m
//   0.5,1.25
//   4,1.25
//                     <- an empty row begins a new polyline
//   4,2
//   4,6.5
//
// The first row may name the columns: `x,y` or `x_m,y_m`. A # begins a comment; a row that is only
// a comment is not empty. The first row determines the separator: a semicolon if it has one, else a
// tab if it has one, else a comma. Rows end with LF or CR LF; spaces around numbers are skipped, as
// is a byte order mark. Numbers have a decimal point. A polyline may have a single point.
#pragma once

#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/formats/maps/polyline_file.h"

namespace pheromone::maps {

Result<std::vector<Polyline>> ParseCsvLines(std::string_view text, std::string_view name);

}  // namespace pheromone::maps
