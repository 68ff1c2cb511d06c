// pheromonectl capture start, stop, status: the recording of all that passes a running server
// (server/capture). Each prints what is so then, as a line for people or, with --json, as the
// server sent it, or says on standard error what is wrong; it returns the exit status
// (server_call.h).
#pragma once

#include <string>

#include <boost/json/value.hpp>

#include "server/ctl/server_call.h"

namespace pheromone::ctl {

/// Returns when the first file is there.
int StartCapture(const ServerOptions& options);
/// Returns when the last file is whole: it can be replayed.
int StopCapture(const ServerOptions& options);
int ShowCapture(const ServerOptions& options);

/// The server's view of its recording, in a line.
std::string DescribeCapture(const boost::json::value& capture);

}  // namespace pheromone::ctl
