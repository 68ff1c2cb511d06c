// Predefined paths: pheromone deposited along a line before any robot moves. The paper's experiment
// follows such a path, on a pheromone that never evaporates (Susnea et al. 2009, "General
// Conditions").
//
// A path is a polyline in whole micrometres; circles and splines are turned into polylines when the
// configuration is read (CirclePoints, SplinePoints), so that the engine's input is in integers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/core/field/geometry.h"
#include "server/core/field/law.h"

namespace pheromone::field {

struct Path {
  uint8_t type = 1;             ///< the pheromone of the path
  uint16_t count = 1;           ///< minimum number of quanta at each of its nodes
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
/// sides of about `step_um`. Repeated points are used once.
std::vector<PointUm> SplinePoints(const std::vector<PointUm>& points, bool closed, int64_t step_um);

/// The nodes of a path: the nearest ones to points along it, at steps of one cell, without corners,
/// so that the line is one node wide. Each node once, in the order of the path. The path must be on
/// the map.
std::vector<NodeIndex> NodesAlong(const MapGeometry& map, const Path& path);

/// The distance of `point` from the path, in micrometres, and how far along the path the nearest
/// point lies. For measurements; not part of the specified arithmetic.
struct PathPosition {
  double distance_um = 0;
  double along_um = 0;
};
PathPosition Locate(const Path& path, double x_um, double y_um);

/// The index of the path that is nearest to a point, the first of those equally near. Requires one.
size_t NearestPath(std::span<const Path> paths, double x_um, double y_um);

/// The path's length in micrometres.
double LengthOf(const Path& path);

}  // namespace pheromone::field
