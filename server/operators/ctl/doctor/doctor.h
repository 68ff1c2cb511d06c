// pheromonectl doctor: looks at all that a laboratory needs on its first day, with a running server
// and without one.
#pragma once

#include <string>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// Prints what was found. `config` empty: the file of the running server, or of the service, or
/// else the default configuration. kFailed: there is a fault.
int Examine(const ServerOptions& options, const std::string& config);

}  // namespace pheromone::ctl
