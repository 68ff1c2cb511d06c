// From places on the Earth to places on the map and back. The map is the plane that touches the
// WGS-84 ellipsoid (or runs parallel to it at the datum's height) in the datum, x to the east and y
// to the north:
//
//   const LocalFrame frame = LocalFrame::At({47.3769, 8.5417, 408.0}).value();
//   const EastNorthUp here = frame.ToLocal({47.3771, 8.5420, 408.0});  // metres
//   const Wgs84 there = frame.GroundAt(22.6, 22.2);                    // degrees
//
// The plane leaves the curved Earth with the square of the distance: at 1 km from the datum the
// ground lies 8 cm below it, at 10 km 8 m, and a length along the ground shows 0.004 mm and 4 mm
// shorter. East and north are those of the datum: seen from a place dx to its east, true north is
// turned by about dx tan(latitude) / 6378 km, which is 0.09 degrees for 10 km at 45 degrees.
//
// The conversion is geocentric, by GeographicLib's LocalCartesian (Karney, "Algorithms for
// geodesics", J. Geodesy 87, 2013, and its documentation). Immutable; any thread.
#pragma once

#include <cstdint>
#include <memory>

#include "server/base/result.h"

namespace pheromone::maps {

/// A place on the Earth; the height is above the WGS-84 ellipsoid, not above the sea.
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

  /// Both exact to some nanometres near the Earth. A latitude beyond 90 degrees gives NaN.
  EastNorthUp ToLocal(const Wgs84& place) const;
  Wgs84 ToWgs84(const EastNorthUp& local) const;

  /// The place at the datum's height that ToLocal maps to these coordinates: where a robot stands
  /// that is there on the map. For up to 1000 km from the datum.
  Wgs84 GroundAt(double east_m, double north_m) const;

 private:
  struct Projection;  // the library's, which is nobody else's business

  explicit LocalFrame(const Wgs84& datum);

  Wgs84 datum_;
  std::shared_ptr<const Projection> projection_;
};

/// The binary angle (65 536 a turn, counter-clockwise from +x, that is from east) that is nearest
/// to a compass heading in degrees clockwise from north; any finite number of turns.
uint16_t HeadingFromCompass(double compass_deg);

/// Its inverse, exactly: 0 <= degrees < 360.
double CompassFromHeading(uint16_t heading);

}  // namespace pheromone::maps
