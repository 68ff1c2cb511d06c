// Where a robot has no room: a disc that must not overlap the obstacles of the map.
//
//   robot.drive.blocked = BlockedBy(field_config, /*radius_m=*/0.25);
//
// Obstacles are the squares of the field's mask (server/field/obstacles.h), which cover what is in
// the configuration by up to a cell more. The map's edge is none: beyond it robots stop by
// themselves. Decided in whole micrometres. Pure; any thread.
#pragma once

#include "client_fw/sim/differential_drive.h"
#include "server/field/config.h"

namespace pheromone::swarm {

/// Whether a disc of `radius_m` there touches an obstacle; empty if the map has none. It shares the
/// mask of `field`, which need not outlive it.
sim::Blocked BlockedBy(const field::FieldConfig& field, double radius_m);

}  // namespace pheromone::swarm
