// pheromonectl net replay: what the nets of a server have fired, from its journal.
#pragma once

#include <string>

namespace pheromone::ctl {

/// Applies the events of a journal again, and writes a line of JSON for each firing of a net:
///
///   {"sequence":12,"field_time_ms":1100,"net":"bench","transition":"N1.present","robot":15,
///    "robot_id":"0a:0b"}
///
/// and, when a net begins and at the end,
///
///   {"sequence":3,"field_time_ms":0,"net":"bench","begins":{"nest":4,...},"from":"configuration"}
///   {"sequence":90,"field_time_ms":9000,"net":"bench","ends":{"nest":3,...}}
///
/// with the places that have tokens. `from` is "configuration", "reset" or, if the journal's
/// beginning was removed, "snapshot"; a robot is an author's number, 0 the environment. `net`:
/// only this one; empty: all. The exit status, 4 if events are missing; errors are reported.
int ReplayNets(const std::string& path, const std::string& net, const std::string& output);

}  // namespace pheromone::ctl
