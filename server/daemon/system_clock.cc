#include "server/daemon/system_clock.h"

#include <ctime>

namespace pheromone::daemon {
namespace {

int64_t Milliseconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return int64_t{now.tv_sec} * 1000 + now.tv_nsec / 1'000'000;
}

}  // namespace

engine::ClockReading ReadSystemClocks() {
  return {static_cast<uint64_t>(Milliseconds(CLOCK_BOOTTIME)), Milliseconds(CLOCK_REALTIME)};
}

uint64_t ReadUtcNs() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return static_cast<uint64_t>(now.tv_sec) * 1'000'000'000 + static_cast<uint64_t>(now.tv_nsec);
}

}  // namespace pheromone::daemon
