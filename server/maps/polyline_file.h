// Paths for robots out of files that people have: lines of points, in whole micrometres of the map.
//
//   PolylineOptions options;
//   options.metres_per_unit = 0.01;  // the drawing's user unit is a centimetre
//   Result<std::vector<Polyline>> lines = LoadPolylines("course.svg", options);
//   if (!lines.ok()) { std::cerr << lines.error() << '\n'; }  // course.svg:12:31: found ...
//
//   .csv             x,y in metres                                     csv_line.h
//   .geojson, .json  RFC 7946: degrees around a datum, or metres       geojson.h
//   .svg             drawings: paths and simple shapes, transformed    svg_file.h
//
// What holds for all of them: coordinates are rounded to the nearest micrometre; neighbouring
// points of a line differ; a line that ends where it began is closed, and the repeated point left
// out. Not accepted: coordinates beyond 1000 km, more than a million points, files over 16 MiB, and
// a file without any line, since somebody meant to lay a path. Reading takes at most some 350 MB of
// memory.
//
// Errors read `FILE:LINE:COLUMN: found ..., expected ...`; lines and columns count from 1, columns
// in bytes. All functions are pure but for LoadPolylines, which reads one file; any thread may call
// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/field/geometry.h"
#include "server/maps/geodesy.h"

namespace pheromone::maps {

struct Polyline {
  std::vector<field::PointUm> points;  ///< at least one
  bool closed = false;                 ///< the last point is joined to the first
  bool operator==(const Polyline&) const = default;
};

constexpr size_t kMaxPolylineFileBytes = size_t{16} << 20;
constexpr size_t kMaxPolylinePoints = 1'000'000;
constexpr double kMaxCoordinateUm = 1e12;  ///< 1000 km

/// What the coordinates of a GeoJSON file are.
enum class GeoJsonUnit : uint8_t {
  kDegrees,  ///< WGS-84 longitude and latitude, as RFC 7946 has it
  kMetres,   ///< x and y on the map
};

struct PolylineOptions {
  GeoJsonUnit geojson_unit = GeoJsonUnit::kDegrees;
  std::optional<Wgs84> datum;      ///< where the map's (0, 0) is; needed for degrees
  double metres_per_unit = 0.001;  ///< what an SVG's user unit is worth
  std::string svg_id;              ///< only the SVG element with this id; empty = all
  int64_t tolerance_um = 1000;     ///< how far a side may lie from the curve it stands for, >= 1
};

enum class PolylineFormat : uint8_t { kCsv, kGeoJson, kSvg };

/// The lines of `text`; `name` is what errors call it.
Result<std::vector<Polyline>> ParsePolylines(PolylineFormat format, std::string_view text,
                                             std::string_view name, const PolylineOptions& options);

/// The lines of a regular file, its format told by its extension in any case.
Result<std::vector<Polyline>> LoadPolylines(const std::filesystem::path& path,
                                            const PolylineOptions& options);

}  // namespace pheromone::maps
