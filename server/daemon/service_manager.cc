#include "server/daemon/service_manager.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdint>
#include <ctime>

namespace pheromone::daemon::service_manager {
namespace {

constexpr int64_t kNanosecondsPerMicrosecond = 1000;
constexpr int64_t kMicrosecondsPerSecond = 1'000'000;
constexpr int64_t kStartTimeoutUs = 30 * kMicrosecondsPerSecond;

void Notify(const std::string& lines) {
  (void)sd_notify(/*unset_environment=*/0, lines.c_str());  // a failure cannot be reported
}

// A line feed would end the value and begin another.
std::string OneLine(std::string text) {
  for (char& c : text) {
    if (c == '\n') {
      c = ' ';
    }
  }
  return text;
}

}  // namespace

void Starting(const std::string& status) {
  Notify("EXTEND_TIMEOUT_USEC=" + std::to_string(kStartTimeoutUs) + "\nSTATUS=" + OneLine(status));
}

void Ready(const std::string& status) {
  Notify("READY=1\nSTATUS=" + OneLine(status));
}

void Tell(const std::string& status) {
  Notify("STATUS=" + OneLine(status));
}

void Reloading() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const int64_t now_us =
      now.tv_sec * kMicrosecondsPerSecond + now.tv_nsec / kNanosecondsPerMicrosecond;
  Notify("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(now_us));
}

void Stopping() {
  Notify("STOPPING=1");
}

void Alive() {
  Notify("WATCHDOG=1");
}

std::optional<std::chrono::milliseconds> AliveInterval() {
  uint64_t limit_us = 0;
  if (sd_watchdog_enabled(/*unset_environment=*/0, &limit_us) <= 0) {
    return std::nullopt;
  }
  const auto limit = std::chrono::microseconds(static_cast<int64_t>(limit_us));
  return std::max(std::chrono::duration_cast<std::chrono::milliseconds>(limit / 2),
                  std::chrono::milliseconds(1));
}

}  // namespace pheromone::daemon::service_manager
