// pheromonectl cluster check: what a server knows of its cluster, and what each member of etcd
// says, seen from this machine.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// Prints what was found (doctor/findings.h). `config` empty: the file of the running server, or
/// else of the service.
/// kFailed: there is a fault, or no cluster.
int CheckCluster(const ServerOptions& options, const std::string& config);

/// Of the IDs of the members that answer, of `members` in all, that which more than half of all
/// have, or that on which those that answer agree; empty: nobody can say which of them are wrong.
std::string ClusterOfMost(const std::vector<std::string>& cluster_ids, size_t members);

}  // namespace pheromone::ctl
