// What a request may change: pheromone on the map, robots' commands, the configuration, a
// recording. The body is a JSON object; each of these reads it, has the change made through the
// control interface, and says what was done. What cannot be done leaves everything as it was.
//
// Statuses: 400 for a body that is not as it should be, 409 for what the server refuses as it is
// now (no such robot, the map is full), 501 for what this server cannot do.
#pragma once

#include "server/engine/control.h"
#include "server/web/fields.h"
#include "server/web/http.h"

namespace pheromone::web {

/// pheromone, x_m, y_m, quanta: to the nearest node, as a robot's DEPOSIT.
Response Deposit(engine::Control* control, Fields* fields);

/// pheromone and a shape: area_m = [x, y, x, y], or points_m = [[x, y], ...] and radius_m, or
/// all = true.
Response Erase(engine::Control* control, Fields* fields);

/// The same with units, the content that each node gets (default: the maximum), and add = true to
/// add it to what is there.
Response Paint(engine::Control* control, Fields* fields);

/// link, id, command, arguments = [...].
Response Command(engine::Control* control, Fields* fields);

Response Halt(engine::Control* control, Fields* fields);
Response Reload(engine::Control* control, Fields* fields);
Response Snapshot(engine::Control* control, Fields* fields);

/// action: "start" or "stop" the recording.
Response Capture(engine::Control* control, Fields* fields);

}  // namespace pheromone::web
