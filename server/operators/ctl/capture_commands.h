// pheromonectl capture start, stop, status: the recording of a running server's traffic
// (server/store/capture). Each prints the resulting status, as a readable line or, with --json, as
// sent by the server, or an error on standard error; it returns the exit status (server_call.h).
#pragma once

#include <string>

#include <boost/json/value.hpp>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// Returns when the first file exists.
int StartCapture(const ServerOptions& options);
/// Returns when the last file is complete and can be replayed.
int StopCapture(const ServerOptions& options);
int ShowCapture(const ServerOptions& options);

/// Prints the server's status of its recording in one line.
std::string DescribeCapture(const boost::json::value& capture);

}  // namespace pheromone::ctl
