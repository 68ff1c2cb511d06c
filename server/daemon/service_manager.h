// What the daemon tells the service manager that started it (sd_notify(3)): systemd, or whoever
// listens on $NOTIFY_SOCKET. Where nobody does, nothing happens.
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

/// The start is not over yet, and goes on: the service manager waits for 30 s more from now on
/// before it takes it for failed. To be called more often than that.
void Starting(const std::string& status);
/// The start, or a reload, is over; `status` is the line that `systemctl status` shows.
void Ready(const std::string& status);
/// A new line for `systemctl status`.
void Tell(const std::string& status);
/// The configuration is being read again; ends with Ready.
void Reloading();
/// The orderly stop has begun.
void Stopping();
/// The watchdog is fed.
void Alive();

/// How often Alive should be called: half of the time that the service manager waits for it.
/// Nothing if it does not.
std::optional<std::chrono::milliseconds> AliveInterval();

}  // namespace pheromone::daemon::service_manager
