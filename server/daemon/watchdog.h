// Says that the daemon is alive, as long as it is: again and again a probe goes through what a
// robot's deposit goes through, the I/O threads, the engine's lock and the log. Only when it has
// come back is `alive` called, so that a daemon that hangs anywhere falls silent and is restarted.
//
//   Watchdog watchdog(strand, &service, &log, interval, service_manager::Alive);
//   watchdog.Start();
//
// Start and Stop on the strand, which `alive` is called on too. All that is given outlives it.
#pragma once

#include <chrono>
#include <functional>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/engine/ordered_log.h"
#include "server/engine/service.h"

namespace pheromone::daemon {

class Watchdog {
 public:
  Watchdog(boost::asio::any_io_executor strand, const engine::Service* service,
           engine::OrderedLog* log, std::chrono::milliseconds interval,
           std::function<void()> alive);

  /// The first probe goes out at once, and each further one an interval after the last; one that is
  /// on its way is waited for.
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
