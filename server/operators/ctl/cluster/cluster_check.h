// pheromonectl cluster check: what a server knows of its cluster, and what each member of etcd
// says, seen from this machine.
#pragma once

#include <string>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// Prints what was found (doctor/findings.h). `config` empty: the file of the running server, or
/// else of the service.
/// kFailed: there is a fault, or no cluster.
int CheckCluster(const ServerOptions& options, const std::string& config);

}  // namespace pheromone::ctl
