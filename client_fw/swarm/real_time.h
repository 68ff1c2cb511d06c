// What programs need that run in real time until somebody stops them.
//
//   const volatile std::sig_atomic_t* stop = StopOnSignals();
//   while (*stop == 0) { ... MonotonicNs() ... }
#pragma once

#include <csignal>
#include <cstdint>

namespace pheromone::swarm {

/// Of a clock that nobody sets.
int64_t MonotonicNs();

/// From now on SIGINT and SIGTERM do nothing but make this other than 0.
const volatile std::sig_atomic_t* StopOnSignals();

}  // namespace pheromone::swarm
