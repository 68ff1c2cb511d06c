// The requests that change something: pheromone on the map, robots' commands, the configuration, a
// recording. The body is a JSON object; each function parses it, makes the change through the
// control interface, and responds when it is done. A refused request changes nothing. None of them
// blocks; the parameters are read before it returns.
//
// Statuses: 400 for an invalid body, 409 for what the server refuses as it is
// now (no such robot, the shape contains no node of the map, the map is full), 501 for what this
// server cannot do.
#pragma once

#include "server/operators/control/control.h"
#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/http.h"

namespace pheromone::web {

/// pheromone, x_m, y_m, quanta: to the nearest node, as a robot's DEPOSIT.
void Deposit(control::Control* control, Parameters* fields, Respond respond);

/// pheromone and a shape: area_m = [x, y, x, y], or points_m = [[x, y], ...] and radius_m, or
/// all = true. Answers with the number of map nodes in the shape, of those whose level has changed,
/// the edit's ID, and whether part of it is off the map. continues = the ID of the last edit, to be
/// undone together with it.
void Erase(control::Control* control, Parameters* fields, Respond respond);

/// The same with units, the value for each node (default: the maximum), and add = true to add it to
/// the present value.
void Paint(control::Control* control, Parameters* fields, Respond respond);

/// Undo the last edit of the map that is not yet undone; redo the one that was undone last. Answer
/// with its ID, its name, when it was made, and how many nodes have changed.
void Undo(control::Control* control, Parameters* fields, Respond respond);
void Redo(control::Control* control, Parameters* fields, Respond respond);

/// link, id, command, arguments = [...].
void Command(control::Control* control, Parameters* fields, Respond respond);

/// link, id, x_m, y_m, tolerance_m; or link, id, cancel = true.
void GoTo(control::Control* control, Parameters* fields, Respond respond);

/// pheromone, tau_s: its evaporation, until the configuration is reread.
void ChangeLaw(control::Control* control, Parameters* fields, Respond respond);

/// ids = [...]: the robots whose keys are revoked. Answers with the links that had them, and
/// whether that outlives the server.
void RevokeKeys(control::Control* control, Parameters* fields, Respond respond);

void Halt(control::Control* control, Parameters* fields, Respond respond);
/// Changes nothing: tells whoever has the right token so, before it is needed.
void Unlock(control::Control* control, Parameters* fields, Respond respond);
void Reload(control::Control* control, Parameters* fields, Respond respond);
void Snapshot(control::Control* control, Parameters* fields, Respond respond);

/// successor: a node of the cluster, or nothing: another server orders the changes.
void StepDown(control::Control* control, Parameters* fields, Respond respond);

/// action: "start" or "stop" the recording.
void Capture(control::Control* control, Parameters* fields, Respond respond);

}  // namespace pheromone::web
