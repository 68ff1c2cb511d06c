// Stands in for the service manager and measures how often pheromoned notifies its watchdog
// (sd_watchdog_enabled(3)).
#pragma once

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include "proto_tests/exchange_bench/server_process.h"

namespace pheromone::bench {

class FedWatchdog {
 public:
  /// Creates a socket in `folder`.
  explicit FedWatchdog(const std::string& folder);
  FedWatchdog(const FedWatchdog&) = delete;
  FedWatchdog& operator=(const FedWatchdog&) = delete;
  ~FedWatchdog();

  /// The environment variables for pheromoned.
  Environment environment() const;

  /// The longest time without a notification since the last call.
  std::chrono::milliseconds TakeLongest();

 private:
  using Clock = std::chrono::steady_clock;

  void Hear();

  const std::string path_;
  int socket_ = -1;
  std::atomic<Clock::duration> longest_ = Clock::duration::zero();
  std::atomic<Clock::time_point> last_ = Clock::now();
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace pheromone::bench
