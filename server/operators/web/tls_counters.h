// What TLS connections count, for metrics. Thread-safe.
#pragma once

#include <atomic>
#include <cstdint>

namespace pheromone::web {

struct TlsCounters {
  std::atomic<uint64_t> connections{0};  ///< at present, with those that are not established yet
  std::atomic<uint64_t> accepted{0};     ///< handshakes that succeeded
  std::atomic<uint64_t> failed{0};       ///< and those that did not
};

}  // namespace pheromone::web
