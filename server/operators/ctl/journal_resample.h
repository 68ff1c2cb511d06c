// Moves the state of a stopped server to a map of another origin, size or cell size.
#pragma once

#include <string>

namespace pheromone::ctl {

/// The deposits of robots and operators are moved to the map of this configuration, node by node
/// (maps/resample.h); the initial contents of the old configuration are dropped, since the new one
/// has its own. Tags, the symbol tables and nets continue as after a restart with this
/// configuration. The folder then contains the new state, in a new epoch: robots must send HELLO
/// again. The old one is kept beside it, as FOLDER.before. All or nothing.
///
/// Prints what was done, or an error to standard error. Returns the exit status: 0; 1 if the folder
/// cannot be used, or a server uses it; 2 for an error in the configuration, or a state that does
/// not match it; 4 if the journal is damaged.
int ResampleJournal(const std::string& config_file, const std::string& name);

}  // namespace pheromone::ctl
