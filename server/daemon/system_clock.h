// The machine's clocks, for the engine's service.
#pragma once

#include "server/core/engine/service/field_clock.h"

namespace pheromone::daemon {

/// CLOCK_BOOTTIME and CLOCK_REALTIME now. Thread-safe.
engine::ClockReading ReadSystemClocks();

/// CLOCK_REALTIME in nanoseconds. Thread-safe.
uint64_t ReadUtcNs();

}  // namespace pheromone::daemon
