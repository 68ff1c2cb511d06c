// The recordings in the server's folder of captures, for download: *.pcapng, and *.mcap that were
// put beside them for viewers.
//
//   GET /api/v1/captures                 their names and sizes
//   GET /api/v1/captures/NAME            one of them; Range and If-Range are obeyed
//
// Both wait for the disk: call them in a lane. A file is sent as long as it was when it was opened,
// even if the recording goes on; if it has become shorter, the connection ends.
#pragma once

#include <string>
#include <string_view>

#include "server/base/descriptor.h"
#include "server/base/result.h"
#include "server/operators/control/control.h"
#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/http.h"
#include "server/operators/web/lanes.h"

namespace pheromone::web {

/// Whether a recording may have this name; so it names nothing outside of their folder.
bool IsCaptureName(std::string_view name);

/// Opens one of them. Errors: there is none of this name, or it cannot be opened. Waits for the
/// disk.
Result<Descriptor> OpenCapture(const std::string& folder, const std::string& name);

Response ListCaptures(const control::Control& control, Parameters* fields);

/// Of the request, the headers count. The lane reads the file while it is sent.
Response SendCapture(const control::Control& control, const std::string& name,
                     const Request& request, const Lane& lane);

}  // namespace pheromone::web
