// A route for a robot: from where it is to another point of the map, around the obstacles.
//
//   Result<std::vector<PointUm>> route = FindRoute(map, obstacles, robot, goal);
//   // route.value(): its corners, from the robot's position to the goal
//
// The straight line if it is free; otherwise the shortest way over the nodes (A*, Hart et al. 1968,
// with steps of 1 and sqrt(2) cells), with the corners that the straight line can cut taken out.
// It keeps `clearance_um` from obstacles, or else a half, a quarter ... of it, down to none, if
// there is no other way. Near its ends it may be closer: a robot may stand beside a wall.
//
// May take a second on a large map with obstacles, and then needs a hundred megabytes: not to be
// called under a lock. Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/base/result.h"
#include "server/core/field/config.h"

namespace pheromone::field {

/// Room for half of a Pioneer 3 (0.38 m x 0.46 m), and some more.
constexpr int64_t kRouteClearanceUm = 300'000;
/// So many corners a route may have, its ends included.
constexpr size_t kMaxRoutePoints = 256;
/// So many nodes are looked at.
constexpr size_t kMaxRouteNodes = 1'000'000;

/// Both points included; at least two. Errors: `to` is off the map or blocked by an obstacle,
/// `from` is off the map, there is no route or none within the limits above.
Result<std::vector<PointUm>> FindRoute(const MapGeometry& map,
                                       const Shared<ObstacleMask>& obstacles, PointUm from,
                                       PointUm to, int64_t clearance_um = kRouteClearanceUm);

}  // namespace pheromone::field
