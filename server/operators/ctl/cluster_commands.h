// pheromonectl cluster: one of several servers with one log. Prints what was done, and returns the
// exit status (server_call.h).
#pragma once

#include <string>

#include <boost/json/value.hpp>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// Who leads, how far this server has followed, and which others it reaches. kFailed: changes are
/// not accepted at present.
int ShowCluster(const ServerOptions& options);

/// The same but for the others, of the `cluster` of a server's status.
std::string DescribeCluster(const boost::json::value& cluster);

/// Lets another server lead, `successor` if it is not empty; waits until one does. kFailed: none
/// does, or another one than that.
int StepDown(const ServerOptions& options, const std::string& successor);

}  // namespace pheromone::ctl
