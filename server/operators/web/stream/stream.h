// The stream for viewers: a server for Foxglove's WebSocket protocol, at the address of the HTTP
// API.
//
//   Stream stream(&control, options, lanes, change);
//   server.OnUpgrade("/", stream.Handler());
//   std::thread thread([&] { stream.Run(); });   // of low priority
//   ...
//   stream.Stop();                               // then join, before `control` is destroyed
//
// One thread reads from and writes to all viewers, and makes what they see (hub.h), so that neither
// requests nor robots wait for a viewer; it pauses between small pieces of work (pacer.h). Views of
// the control interface are taken in lanes.requests, since the service's lock must not be held by a
// thread of low priority. Changes are requests to the API, made in that lane too.
//
// Access: as for GET (Api::CheckStream); Origins of other pages only if they are listed. Changes
// over TCP need the token in the header Authorization, or, since browsers cannot send the header, a
// ticket in the URL (api/ticket.h). Without either, every change is refused.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/operators/control/control.h"
#include "server/operators/control/stream_counters.h"
#include "server/operators/web/api/api.h"
#include "server/operators/web/lanes.h"
#include "server/operators/web/upgrade.h"

namespace pheromone::web {

struct StreamOptions {
  size_t max_viewers = 32;
  std::string ros_distro = "humble";  ///< told to viewers, some of which need it; empty: none
  std::string click_pheromone = {};   ///< of /clicked_point; empty: the first one
  /// After which a viewer to which nothing can be sent is disconnected.
  std::chrono::milliseconds write_patience{30'000};
};

class Stream {
 public:
  /// `control`, `api` and what is behind `lanes` outlive it.
  Stream(control::Control* control, Api* api, StreamOptions options, Lane requests);
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream();

  /// May be used as long as this exists.
  UpgradeHandler Handler();

  /// Returns after Stop.
  void Run();
  /// Closes all connections. Any thread.
  void Stop();

  const StreamCounters& counters() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace pheromone::web
