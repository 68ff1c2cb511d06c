// CLOCK_BOOTTIME, which goes on while the machine is suspended.
#pragma once

#include <time.h>

#include <cstdint>

namespace pheromone {

/// Milliseconds. Thread-safe.
inline uint64_t BoottimeMs() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return static_cast<uint64_t>(now.tv_sec) * 1000 + static_cast<uint64_t>(now.tv_nsec) / 1'000'000;
}

}  // namespace pheromone
