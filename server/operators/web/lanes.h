// The threads on which requests are answered. One reads requests and answers short ones; long ones
// go to other threads.
//
//   if (!RunIn(lanes.pictures, [=] { draw and respond })) { respond(Busy()); }
#pragma once

#include <functional>
#include <utility>

#include "server/operators/web/http.h"

namespace pheromone::web {

using Work = std::function<void()>;

/// Queues work for another thread, or returns false if the queue is full. Work dropped later, when
/// the server stops, destroys its respond function, which then answers. Empty: the work is done at
/// once by the caller.
using Lane = std::function<bool(Work)>;

struct Lanes {
  Lane long_work = {};  ///< long answers and long requests
  Lane pictures = {};   ///< reads and encodes the field; takes no lock for which robots wait
  Lane requests = {};   ///< a thread that reads requests
  Lane files = {};  ///< reads files that are downloaded; has room for one read of each connection
};

inline bool RunIn(const Lane& lane, Work work) {
  if (!lane) {
    work();
    return true;
  }
  return lane(std::move(work));
}

inline Response Busy() {
  return Refuse(
      503, {"the server is busy with other requests", "", "fewer requests at a time; try again"});
}

}  // namespace pheromone::web
