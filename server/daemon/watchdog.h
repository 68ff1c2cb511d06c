// Reports that the daemon is alive: a periodic probe passes through what answers a robot's
// question, the I/O threads and the engine's lock. `alive` is called only when it has returned, so
// that a daemon that hangs there stops reporting and is restarted. A disk that does not respond is
// not the daemon's failure: robots still sense and are halted; /healthz and the log tell of it.
//
//   Watchdog watchdog(strand, &service, interval, service_manager::Alive);
//   watchdog.Start();
//
// Start and Stop are called on the strand, and so is `alive`. All arguments outlive it.
#pragma once

#include <chrono>
#include <functional>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/core/engine/service/service.h"

namespace pheromone::daemon {

class Watchdog {
 public:
  Watchdog(boost::asio::any_io_executor strand, const engine::Service* service,
           std::chrono::milliseconds interval, std::function<void()> alive);

  /// The first probe is made at once, and each further one an interval after the last.
  void Start();
  void Stop();

 private:
  void Probe();

  const engine::Service* service_;
  const std::chrono::milliseconds interval_;
  const std::function<void()> alive_;
  boost::asio::steady_timer timer_;
  bool stopped_ = false;
};

}  // namespace pheromone::daemon
