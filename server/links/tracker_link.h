// A UDP listener for trackers (tracker_message.h): what they see takes the place of what robots
// report of themselves, for a while.
//
//   TrackerLink tracker(io, {.listen_address = "127.0.0.1", .listen_port = 7777}, &service,
//                       [frame](const GpsFix& fix) { return ...; }, log);
//   const Status first_try = tracker.Start();   // goes on trying if this failed
//   ...
//   tracker.Stop();                             // io runs dry
//
// Anyone who can send to the port can move every robot: listen on localhost, or on a network that
// is yours. Nothing is ever sent back.
//
// Start is called once, before or while the io_context runs; the tracker outlives the run. All
// other functions are thread-safe. Bad lines are counted by reason, and told at most once a second.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/base/result.h"
#include "server/engine/service.h"
#include "server/links/backoff.h"
#include "server/links/link.h"
#include "server/links/tracker_message.h"

namespace pheromone::links {

struct TrackerOptions {
  std::string listen_address;  ///< numeric, IPv4 or IPv6
  uint16_t listen_port = 0;    ///< 0: the system chooses, see address()
  uint32_t valid_ms = 1000;    ///< how long a pose is believed when no other follows
  BackoffOptions backoff;
};

struct TrackerCounters {
  uint64_t datagrams = 0;
  uint64_t poses = 0;      ///< taken by the engine
  uint64_t not_taken = 0;  ///< of robots that have not said HELLO, or while the log is closed
  std::array<uint64_t, kTrackerFaults> faults{};  ///< lines that were none, by TrackerFault
};

/// The pose on the map of a robot that is on the Earth, or nothing if that is out of its range,
/// such as the other side; called from the io_context's threads. Null if the map has no place
/// there: then `gps` lines are faults.
using GpsToMap = std::function<std::optional<field::PoseUm>(const GpsFix&)>;

class TrackerLink {
 public:
  /// `service` outlives the tracker.
  TrackerLink(boost::asio::io_context& io, TrackerOptions options, engine::Service* service,
              GpsToMap gps_to_map, LinkLog log);
  TrackerLink(const TrackerLink&) = delete;
  TrackerLink& operator=(const TrackerLink&) = delete;
  ~TrackerLink();

  /// Listens. An error tells why that failed; the tracker then tries again.
  Status Start();
  void Stop();

  /// ADDRESS:PORT; empty while it does not listen.
  std::string address() const;
  TrackerCounters counters() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pheromone::links
