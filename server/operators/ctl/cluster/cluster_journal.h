// pheromonectl cluster leave, reset: to which cluster the journal of a stopped server belongs
// (server/store/journal/membership.h). The map and the log are not changed.
//
// Each prints what was done, or an error to standard error, and returns the exit status: 0; 1 if
// the folder cannot be used, a server uses it, or it has to be confirmed; 2 for an error in the
// command line; 4 if the journal is damaged.
#pragma once

#include <string>

namespace pheromone::ctl {

/// The folder belongs to no cluster any more: its server goes on alone. A new epoch begins then,
/// since the others may have gone on.
int LeaveCluster(const std::string& folder);

/// The log of this cluster, which has to be empty then, begins with this journal's map, in a new
/// epoch. What others have beyond it is lost, so without `is_confirmed` nothing is done but to say
/// what would be.
int ResetCluster(const std::string& folder, const std::string& cluster, bool is_confirmed);

}  // namespace pheromone::ctl
