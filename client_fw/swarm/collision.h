// Obstacles as robots meet them: a robot is a disc that must not overlap the obstacles of the map,
// and its sonars measure how far they are.
//
//   robot.drive.blocked = BlockedBy(field_config, /*radius_m=*/0.25);
//   robot.range = RangeTo(field_config);
//
// Obstacles are the squares of the field's mask (server/core/field/obstacles.h), which may extend
// the configured obstacles by up to a cell. The edge of the map is not an obstacle: robots beyond
// it stop by themselves. Collisions are computed in whole micrometres. Pure; any thread.
#pragma once

#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/pioneer/pioneer_sensors.h"
#include "server/core/field/config.h"

namespace pheromone::swarm {

/// A function that tells whether a disc of `radius_m` at a pose touches an obstacle; empty if the
/// map has none. It shares the mask of `field`, which need not outlive it.
sim::Blocked BlockedBy(const field::FieldConfig& field, double radius_m);

/// A function that measures the distance to the nearest obstacle along a ray, 0 from inside one;
/// empty if the map has none. It shares the mask as well.
sim::RangeFinder RangeTo(const field::FieldConfig& field);

}  // namespace pheromone::swarm
