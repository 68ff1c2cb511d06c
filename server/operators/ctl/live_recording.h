// A recording of the running server for `pheromonectl export --live`: started, and stopped after a
// time or at Ctrl-C.
//
//   const Result<std::vector<std::string>> files = RecordLive(options, 60);
#pragma once

#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// The files, in order. `seconds` 0: until Ctrl-C. Errors: the server is not there, records
/// already, or cannot write; a file cannot be read from here, or is there no longer.
Result<std::vector<std::string>> RecordLive(const ServerOptions& options, double seconds);

}  // namespace pheromone::ctl
