// The last thousand notices of a server (server/operators/control/notices.h), numbered, for
// programs that ask from time to time what has happened.
//
//   EventLog events(&control, lanes.requests);
//   Response response = events.Read(&fields);        // GET /api/v1/events?since=17
//
// Thread-safe.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>

#include "server/operators/control/control.h"
#include "server/operators/web/api/request_parameters.h"
#include "server/operators/web/http.h"
#include "server/operators/web/lanes.h"

namespace pheromone::web {

class EventLog {
 public:
  /// `lane` notes the time of an event soon after it has happened; empty: when somebody asks.
  /// `control` outlives the log, and the log whatever runs in the lane.
  EventLog(control::Control* control, Lane lane);

  /// since: the number of the last event that is known already; default 0, all.
  Response Read(Parameters* fields);

 private:
  struct Event {
    uint64_t number = 0;
    double time_s = 0;  // since 1970
    control::Notice notice;
  };

  void Take();

  const Lane lane_;
  const double started_s_;
  std::mutex mutex_;
  std::deque<Event> events_;
  uint64_t last_ = 0;                                    // number; 0: none yet
  uint64_t dropped_ = 0;                                 // before they got a number
  std::unique_ptr<control::Subscription> subscription_;  // ends first
};

}  // namespace pheromone::web
