#include "server/daemon/watchdog.h"

#include <utility>

namespace pheromone::daemon {

Watchdog::Watchdog(boost::asio::any_io_executor strand, const engine::Service* service,
                   std::chrono::milliseconds interval, std::function<void()> alive)
    : service_(service), interval_(interval), alive_(std::move(alive)), timer_(std::move(strand)) {}

void Watchdog::Start() {
  Probe();
}

void Watchdog::Stop() {
  stopped_ = true;
  timer_.cancel();
}

void Watchdog::Probe() {
  service_->Inspect([](const engine::Engine&) {});  // returns when it had the lock
  alive_();
  timer_.expires_after(interval_);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error && !stopped_) {
      Probe();
    }
  });
}

}  // namespace pheromone::daemon
