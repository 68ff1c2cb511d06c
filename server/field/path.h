// Predefined paths: pheromone laid along a line before any robot moves. The paper's experiment
// follows such a path, on a pheromone that never evaporates (Susnea et al. 2009, "General
// Conditions").
//
// A path is a polyline in whole micrometres; circles and splines are turned into polylines when the
// configuration is read (CirclePoints, SplinePoints), so that what the engine is given is integers.
#pragma once

#include <cstdint>
#include <vector>

#include "server/field/geometry.h"
#include "server/field/law.h"

namespace pheromone::field {

struct Path {
  uint8_t type = 1;             ///< the pheromone it is laid in
  uint16_t count = 1;           ///< quanta at each of its nodes, at least
  bool closed = false;          ///< the last point is joined to the first
  std::vector<PointUm> points;  ///< at least one
  bool operator==(const Path&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("type", it.type, Within(1, kMaxType));
    visit("count", it.count);
    visit("closed", it.closed);
    visit("points", it.points);
  }
};

/// A closed polyline around `centre`, counter-clockwise from +x, its sides at most `step_um` long.
std::vector<PointUm> CirclePoints(PointUm centre, int64_t radius_um, int64_t step_um);

/// A smooth curve through all of `points` (at least two): the centripetal Catmull-Rom spline
/// (Catmull and Rom 1974; Barry and Goldman 1988, with the exponent 1/2 of Yuksel et al. 2011), in
/// sides of about `step_um`. Repeated points are taken once.
std::vector<PointUm> SplinePoints(const std::vector<PointUm>& points, bool closed, int64_t step_um);

/// The nodes of a path: those nearest to its points, one cell's step after the other, corners cut
/// so that the line is one node wide. Each node once, in the order of the path. The path lies on
/// the map.
std::vector<NodeIndex> NodesAlong(const MapGeometry& map, const Path& path);

/// The distance of `point` from the path, in micrometres, and how far along the path the nearest
/// point lies. For measuring; not part of the defined arithmetic.
struct PathPosition {
  double distance_um = 0;
  double along_um = 0;
};
PathPosition Locate(const Path& path, double x_um, double y_um);

/// The path's length in micrometres.
double LengthOf(const Path& path);

}  // namespace pheromone::field
