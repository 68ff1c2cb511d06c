#include "server/daemon/system_clock.h"

#include <ctime>

#include "server/base/boottime.h"

namespace pheromone::daemon {

engine::ClockReading ReadSystemClocks() {
  return {BoottimeMs(), static_cast<int64_t>(ReadUtcNs() / 1'000'000)};
}

uint64_t ReadUtcNs() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return static_cast<uint64_t>(now.tv_sec) * 1'000'000'000 + static_cast<uint64_t>(now.tv_nsec);
}

}  // namespace pheromone::daemon
