// A latency histogram with fixed buckets, as used by Prometheus.
//
//   LatencyHistogram handling;
//   handling.Count(elapsed_ns);
//   const LatencyCounts counts = handling.counts();
//
// Thread-safe and wait-free. Counts read during updates may differ by a few events.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace pheromone::engine {

/// The upper bounds of all buckets except the last, which is unbounded; in microseconds.
constexpr std::array<uint32_t, 12> kLatencyEndsUs = {1,   2,   5,     10,    20,     50,
                                                     100, 500, 1'000, 5'000, 20'000, 100'000};

struct LatencyCounts {
  std::array<uint64_t, kLatencyEndsUs.size() + 1> by_class{};
  uint64_t sum_ns = 0;
};

class LatencyHistogram {
 public:
  void Count(uint64_t elapsed_ns) {
    size_t place = 0;
    while (place < kLatencyEndsUs.size() && elapsed_ns > uint64_t{kLatencyEndsUs[place]} * 1000) {
      ++place;
    }
    by_class_[place].fetch_add(1, std::memory_order_relaxed);
    sum_ns_.fetch_add(elapsed_ns, std::memory_order_relaxed);
  }

  LatencyCounts counts() const {
    LatencyCounts counts;
    for (size_t i = 0; i < by_class_.size(); ++i) {
      counts.by_class[i] = by_class_[i].load(std::memory_order_relaxed);
    }
    counts.sum_ns = sum_ns_.load(std::memory_order_relaxed);
    return counts;
  }

 private:
  std::array<std::atomic<uint64_t>, kLatencyEndsUs.size() + 1> by_class_{};
  std::atomic<uint64_t> sum_ns_{0};
};

}  // namespace pheromone::engine
