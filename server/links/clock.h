// The clock of the links: the system's steady clock, or a test's.
#pragma once

#include <atomic>
#include <chrono>

namespace pheromone::links {

/// Satisfies the requirements of Asio's timers. Points of time are those of the steady clock.
class Clock {
 public:
  using duration = std::chrono::steady_clock::duration;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::steady_clock::time_point;
  static constexpr bool is_steady = true;

  static time_point now() noexcept {
    const auto source = source_.load(std::memory_order_relaxed);
    return source != nullptr ? source() : std::chrono::steady_clock::now();
  }

  /// For tests in virtual time, which then poll the io_context: where the time comes from. Null:
  /// from the system.
  static void Set(time_point (*source)()) { source_ = source; }

 private:
  static inline std::atomic<time_point (*)()> source_ = nullptr;
};

}  // namespace pheromone::links
