// pheromonectl net list, show and reset: the nets that a running server executes.
#pragma once

#include <string>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// The exit status; errors are reported.
int ListNets(const ServerOptions& options);
int ShowNet(const ServerOptions& options, const std::string& name);
int ResetNet(const ServerOptions& options, const std::string& name);

}  // namespace pheromone::ctl
