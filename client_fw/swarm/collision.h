// Collision test: a robot is a disc that must not overlap the obstacles of the map.
//
//   robot.drive.blocked = BlockedBy(field_config, /*radius_m=*/0.25);
//
// Obstacles are the squares of the field's mask (server/field/obstacles.h), which may extend the
// configured obstacles by up to a cell. The edge of the map is not an obstacle: robots beyond it
// stop by themselves. Computed in whole micrometres. Pure; any thread.
#pragma once

#include "client_fw/sim/differential_drive.h"
#include "server/field/config.h"

namespace pheromone::swarm {

/// A function that tells whether a disc of `radius_m` at a pose touches an obstacle; empty if the
/// map has none. It shares the mask of `field`, which need not outlive it.
sim::Blocked BlockedBy(const field::FieldConfig& field, double radius_m);

}  // namespace pheromone::swarm
