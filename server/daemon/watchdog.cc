#include "server/daemon/watchdog.h"

#include <utility>

#include <boost/asio/post.hpp>

namespace pheromone::daemon {

Watchdog::Watchdog(boost::asio::any_io_executor strand, const engine::Service* service,
                   engine::OrderedLog* log, std::chrono::milliseconds interval,
                   std::function<void()> alive)
    : strand_(std::move(strand)),
      service_(service),
      log_(log),
      interval_(interval),
      alive_(std::move(alive)),
      timer_(strand_) {}

void Watchdog::Start() {
  Probe();
}

void Watchdog::Stop() {
  stopped_ = true;
  timer_.cancel();
}

void Watchdog::Probe() {
  service_->Inspect([](const engine::Engine&) {});  // returns when it had the lock
  log_->Probe([this, strand = strand_] { boost::asio::post(strand, [this] { Return(); }); });
}

void Watchdog::Return() {
  if (stopped_) {
    return;
  }
  alive_();
  timer_.expires_after(interval_);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error && !stopped_) {
      Probe();
    }
  });
}

}  // namespace pheromone::daemon
