// The state of a stopped server, moved to a map of another origin, size or cell size.
#pragma once

#include <string>

namespace pheromone::ctl {

/// What robots and operators left on the map goes to the map of this configuration, node by node
/// (maps/resample.h); what the old configuration laid by itself stays behind, for the new one lays
/// its own. The folder then holds the new state, in a new epoch: robots say hello again. The old
/// one is kept beside it, as FOLDER.before. All or nothing.
///
/// Prints what was done, or what is wrong to standard error. Returns the exit status: 0; 1 if the
/// folder cannot be used, or a server uses it; 2 for a mistake in the configuration, or a state
/// that does not fit it; 4 if something in the journal is damaged.
int ResampleJournal(const std::string& config, const std::string& folder);

}  // namespace pheromone::ctl
