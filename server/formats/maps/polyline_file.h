// Paths for robots from files: polylines in whole micrometres of the map.
//
//   PolylineOptions options;
//   options.metres_per_unit = 0.01;  // the drawing's user unit is a centimetre
//   Result<std::vector<Polyline>> lines = LoadPolylines("course.svg", options);
//   if (!lines.ok()) { std::cerr << lines.error() << '\n'; }  // course.svg:12:31: found ...
//
//   .csv             x,y in metres                                     csv_polyline.h
//   .geojson, .json  RFC 7946: degrees around a datum, or metres       geojson.h
//   .svg             drawings: paths and simple shapes, transformed    svg_file.h
//
// For all formats: coordinates are rounded to the nearest micrometre; neighbouring points of a
// polyline differ; one that ends where it began is closed, and the repeated point is omitted. Not
// accepted: coordinates beyond 1000 km, more than a million points, files over 16 MiB, and a file
// without any polyline, which must be a mistake. Reading needs at most about 350 MB of memory.
//
// Errors read `FILE:LINE:COLUMN: found ..., expected ...`; lines and columns count from 1, columns
// in bytes. All functions are pure except LoadPolylines, which reads one file; any thread may call
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
#include "server/core/field/geometry.h"
#include "server/formats/maps/geodesy.h"

namespace pheromone::maps {

struct Polyline {
  std::vector<field::PointUm> points;  ///< at least one
  bool closed = false;                 ///< the last point is joined to the first
  bool operator==(const Polyline&) const = default;
};

constexpr size_t kMaxPolylineFileBytes = size_t{16} << 20;
constexpr size_t kMaxPolylinePoints = 1'000'000;
constexpr double kMaxCoordinateUm = 1e12;  ///< 1000 km

/// The unit of the coordinates of a GeoJSON file.
enum class GeoJsonUnit : uint8_t {
  kDegrees,  ///< WGS-84 longitude and latitude, as in RFC 7946
  kMetres,   ///< x and y on the map
};

struct PolylineOptions {
  GeoJsonUnit geojson_unit = GeoJsonUnit::kDegrees;
  std::optional<Wgs84> datum;      ///< the position of the map's (0, 0); required for degrees
  double metres_per_unit = 0.001;  ///< the size of an SVG's user unit
  std::string svg_id;              ///< only the SVG element with this id; empty = all
  int64_t tolerance_um = 1000;     ///< maximum distance of a side from its curve, >= 1
};

enum class PolylineFormat : uint8_t { kCsv, kGeoJson, kSvg };

/// The polylines of `text`; `name` is its name in errors.
Result<std::vector<Polyline>> ParsePolylines(PolylineFormat format, std::string_view text,
                                             std::string_view name, const PolylineOptions& options);

/// The polylines of a regular file, whose format is determined by its extension, ignoring case.
Result<std::vector<Polyline>> LoadPolylines(const std::filesystem::path& path,
                                            const PolylineOptions& options);

}  // namespace pheromone::maps
