// For programs that run in real time until they are stopped.
//
//   const volatile std::sig_atomic_t* stop = StopOnSignals();
//   while (*stop == 0) { ... MonotonicNs() ... }
#pragma once

#include <csignal>
#include <cstdint>

namespace pheromone {

/// The time of a monotonic clock.
int64_t MonotonicNs();

/// From now on SIGINT and SIGTERM only make this non-zero; so does SIGHUP, unless it is ignored
/// (nohup).
const volatile std::sig_atomic_t* StopOnSignals();

}  // namespace pheromone
