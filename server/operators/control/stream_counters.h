// What the stream counts, for metrics. Thread-safe.
#pragma once

#include <atomic>
#include <cstdint>

namespace pheromone::web {

struct StreamCounters {
  std::atomic<uint64_t> viewers{0};  ///< connected at present
  std::atomic<uint64_t> accepted{0};
  std::atomic<uint64_t> refused{
      0};  ///< connections beyond the limit or without a known subprotocol
  std::atomic<uint64_t> stalled{0};  ///< disconnected since they did not read
  std::atomic<uint64_t> sent_frames{0};
  std::atomic<uint64_t> sent_bytes{0};
  std::atomic<uint64_t> dropped_frames{0};  ///< replaced by newer ones before they were sent
};

}  // namespace pheromone::web
