// Converts geographic positions to map coordinates. The map is the plane tangent to the WGS-84
// ellipsoid at the datum (or parallel to that plane at the datum's height), x to the east and y to
// the north:
//
//   const LocalFrame frame = LocalFrame::At({47.3769, 8.5417, 408.0}).value();
//   const EastNorthUp here = frame.ToLocal({47.3771, 8.5420, 408.0});  // metres
//
// The distance of the plane from the curved Earth grows with the square of the distance from the
// datum: at 1 km the ground is 8 cm below it, at 10 km 8 m, and a length along the ground appears
// 0.004 mm and 4 mm shorter. East and north are those of the datum: at a position dx to its east,
// true north is turned by about dx tan(latitude) / 6378 km, which is 0.09 degrees for 10 km at 45
// degrees.
//
// The conversion is geocentric, by GeographicLib's LocalCartesian (Karney, "Algorithms for
// geodesics", J. Geodesy 87, 2013, and its documentation). Immutable; any thread.
#pragma once

#include <cstdint>
#include <memory>

#include "server/base/result.h"

namespace pheromone::maps {

/// A geographic position; the height is above the WGS-84 ellipsoid, not above sea level.
struct Wgs84 {
  double latitude_deg = 0;   ///< north, -90 to 90
  double longitude_deg = 0;  ///< east, -180 to 180
  double height_m = 0;
  bool operator==(const Wgs84&) const = default;
};

struct EastNorthUp {
  double east_m = 0;
  double north_m = 0;
  double up_m = 0;
};

class LocalFrame {
 public:
  /// The frame whose origin is `datum`. An error if its coordinates are not within their ranges, or
  /// its height not within 100 km.
  static Result<LocalFrame> At(const Wgs84& datum);

  const Wgs84& datum() const { return datum_; }

  /// Accurate to a few nanometres near the Earth's surface. A latitude beyond 90 degrees gives NaN.
  EastNorthUp ToLocal(const Wgs84& place) const;

 private:
  struct Projection;  // hides the library

  explicit LocalFrame(const Wgs84& datum);

  Wgs84 datum_;
  std::shared_ptr<const Projection> projection_;
};

/// The binary angle (65 536 a turn, counter-clockwise from +x, that is from east) that is nearest
/// to a compass heading in degrees clockwise from north; any finite number of turns.
uint16_t HeadingFromCompass(double compass_deg);

}  // namespace pheromone::maps
