// Reports that the daemon is alive: a periodic probe passes through everything that a robot's
// deposit does, the I/O threads, the engine's lock and the log. `alive` is called only when it has
// returned, so that a daemon that hangs anywhere stops reporting and is restarted.
//
//   Watchdog watchdog(strand, &service, &log, interval, service_manager::Alive);
//   watchdog.Start();
//
// Start and Stop are called on the strand, and so is `alive`. All arguments outlive it.
#pragma once

#include <chrono>
#include <functional>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"

namespace pheromone::daemon {

class Watchdog {
 public:
  Watchdog(boost::asio::any_io_executor strand, const engine::Service* service,
           engine::OrderedLog* log, std::chrono::milliseconds interval,
           std::function<void()> alive);

  /// The first probe is sent at once, and each further one an interval after the last; there is
  /// only one probe in flight.
  void Start();
  void Stop();

 private:
  void Probe();
  void Return();

  boost::asio::any_io_executor strand_;
  const engine::Service* service_;
  engine::OrderedLog* log_;
  const std::chrono::milliseconds interval_;
  const std::function<void()> alive_;
  boost::asio::steady_timer timer_;
  bool stopped_ = false;
};

}  // namespace pheromone::daemon
