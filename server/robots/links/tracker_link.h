// A UDP listener for trackers (tracker_message.h): a tracked pose replaces the pose reported by the
// robot for a limited time.
//
//   TrackerLink tracker(io, {.listen_address = "127.0.0.1", .listen_port = 7777}, &service,
//                       [frame](const GpsFix& fix) { return ...; }, log);
//   const Status first_try = tracker.Start();   // keeps retrying if this failed
//   ...
//   tracker.Stop();                             // io runs dry
//
// Anyone who can send to the port can move every robot: listen on localhost or on a trusted
// network. Nothing is ever sent back.
//
// Start is called once, before or while the io_context runs; the tracker outlives the run. All
// other functions are thread-safe. Bad lines are counted by reason, and logged at most once a
// second.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/base/result.h"
#include "server/core/engine/service/service.h"
#include "server/robots/links/backoff.h"
#include "server/robots/links/link.h"
#include "server/robots/links/link_config.h"
#include "server/robots/links/tracker_message.h"

namespace pheromone::links {

struct TrackerCounters {
  uint64_t datagrams = 0;
  uint64_t poses = 0;                             ///< accepted by the engine
  uint64_t not_taken = 0;                         ///< while the log is closed
  std::array<uint64_t, kTrackerFaults> faults{};  ///< refused lines, by TrackerFault
  std::string last_fault = {};                    ///< with its line; empty: there was none
};

/// Converts a geographic position to a pose on the map; nothing if it is out of range, such as on
/// the other side of the Earth. Called from the io_context's threads. Null if the map has no datum:
/// then `gps` lines are faults.
using GpsToMap = std::function<std::optional<field::PoseUm>(const GpsFix&)>;

class TrackerLink {
 public:
  /// `service` outlives the tracker.
  TrackerLink(boost::asio::io_context& io, const TrackerConfig& config, engine::Service* service,
              GpsToMap gps_to_map, LinkLog log, const BackoffOptions& backoff = {});
  TrackerLink(const TrackerLink&) = delete;
  TrackerLink& operator=(const TrackerLink&) = delete;
  ~TrackerLink();

  /// Listens. Returns an error if that failed; the tracker then keeps retrying.
  Status Start();
  void Stop();

  const std::string& name() const;
  /// Whether it listens, and where, or why not.
  LinkRecord::State state() const;
  /// ADDRESS:PORT; empty while it does not listen.
  std::string address() const { return state().address; }
  TrackerCounters counters() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pheromone::links
