// What a request may change: pheromone on the map, robots' commands, the configuration, a
// recording. The body is a JSON object; each of these reads it, has the change made through the
// control interface, and says what was done when it is. What cannot be done leaves everything as it
// was. None waits; the fields are looked at before it returns.
//
// Statuses: 400 for a body that is not as it should be, 409 for what the server refuses as it is
// now (no such robot, no node of the map lies there, the map is full), 501 for what this server
// cannot do.
#pragma once

#include "server/engine/control.h"
#include "server/web/fields.h"
#include "server/web/http.h"

namespace pheromone::web {

/// pheromone, x_m, y_m, quanta: to the nearest node, as a robot's DEPOSIT.
void Deposit(engine::Control* control, Fields* fields, Respond respond);

/// pheromone and a shape: area_m = [x, y, x, y], or points_m = [[x, y], ...] and radius_m, or
/// all = true. Answers how many nodes of the map lie there, and whether a part of it is off the
/// map.
void Erase(engine::Control* control, Fields* fields, Respond respond);

/// The same with units, the content that each node gets (default: the maximum), and add = true to
/// add it to what is there.
void Paint(engine::Control* control, Fields* fields, Respond respond);

/// link, id, command, arguments = [...].
void Command(engine::Control* control, Fields* fields, Respond respond);

void Halt(engine::Control* control, Fields* fields, Respond respond);
void Reload(engine::Control* control, Fields* fields, Respond respond);
void Snapshot(engine::Control* control, Fields* fields, Respond respond);

/// action: "start" or "stop" the recording.
void Capture(engine::Control* control, Fields* fields, Respond respond);

}  // namespace pheromone::web
