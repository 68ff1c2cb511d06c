// Notifications to the service manager (sd_notify(3)): systemd, or any other process that listens
// on $NOTIFY_SOCKET. Without one, these functions have no effect.
//
//   service_manager::Ready("2 of 2 links up");
//   if (const auto interval = service_manager::AliveInterval()) { ... Alive() that often ... }
//
// Any thread.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace pheromone::daemon::service_manager {

/// The start is still in progress: extends the start-up timeout of the service manager to 30 s from
/// now. To be called more often than that.
void Starting(const std::string& status);
/// The start, or a reload, is over; `status` is the line that `systemctl status` shows.
void Ready(const std::string& status);
/// A new line for `systemctl status`.
void Tell(const std::string& status);
/// The configuration is being reread; ends with Ready.
void Reloading();
/// The orderly stop has begun.
void Stopping();
/// Feeds the watchdog.
void Alive();

/// How often Alive should be called: half the watchdog timeout of the service manager; empty if it
/// has none.
std::optional<std::chrono::milliseconds> AliveInterval();

}  // namespace pheromone::daemon::service_manager
