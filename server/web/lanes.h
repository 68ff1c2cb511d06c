// The threads that a request may be answered on. One reads requests and answers what is short; what
// would hold it up goes to another one.
//
//   if (!RunIn(lanes.pictures, [=] { draw and respond })) { respond(Busy()); }
#pragma once

#include <functional>
#include <utility>

#include "server/web/http.h"

namespace pheromone::web {

using Work = std::function<void()>;

/// Has the work done soon, on another thread, or returns false where there is no room for more.
/// Work that is dropped later, at the end of the server, takes its respond function along, and that
/// answers. Empty: the work is done at once, by whoever asks.
using Lane = std::function<bool(Work)>;

struct Lanes {
  Lane long_work = {};  ///< long texts, and requests that are long themselves
  Lane pictures = {};   ///< looks at the field and encodes; takes no lock that robots wait for
  Lane requests = {};   ///< back to a thread that reads requests
};

inline bool RunIn(const Lane& lane, Work work) {
  if (!lane) {
    work();
    return true;
  }
  return lane(std::move(work));
}

inline Response Busy() {
  return Refuse(503, {"the server is busy with other requests", "", "fewer of them; try again"});
}

}  // namespace pheromone::web
