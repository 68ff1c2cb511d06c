// Polylines from GeoJSON (RFC 7946):
//
//   {"type": "LineString", "coordinates": [[8.5417, 47.3769], [8.5420, 47.3771]]}
//
// All seven geometries, Feature and FeatureCollection: a Point is a polyline of one point, the
// rings of a Polygon are closed polylines. Members that the RFC does not name are ignored, and so
// are heights: the map is flat, so that each position is taken at the datum's height. An object
// without geometry (null, or empty coordinates) has no polylines.
//
// Not accepted: text that is not JSON (nested at most 32 deep, 4 million values), a LineString of
// one position, a ring that is not closed or has fewer than four positions, a position outside
// -180..180 or -90..90 degrees, and, for degrees, a member "crs" (of an earlier GeoJSON) other than
// WGS-84.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/formats/maps/geodesy.h"
#include "server/formats/maps/polyline_file.h"

namespace pheromone::maps {

/// `datum` is required for degrees, and ignored for metres.
Result<std::vector<Polyline>> ParseGeoJsonLines(std::string_view text, std::string_view name,
                                                GeoJsonUnit unit,
                                                const std::optional<Wgs84>& datum);

}  // namespace pheromone::maps
