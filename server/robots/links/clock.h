// The clock of the links: the system's steady clock, or a test's.
//
// In virtual time, one thread polls the io_context whenever the time has changed:
//
//   Clock::Set([] { return now; });
//   for (now = ...;; now = std::min(next_of_mine, Clock::NextTimer())) {
//     Clock::ForgetTimers();
//     io.poll();
//   }
//   Clock::Set(nullptr);
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>

#include <boost/asio/wait_traits.hpp>

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

  /// For tests in virtual time: where the time comes from. Null: from the system.
  static void Set(time_point (*source)()) { source_ = source; }

  /// In virtual time: when the first timer expires, or a little earlier if it was cancelled; max:
  /// none does. As found while the io_context was polled since ForgetTimers.
  static time_point NextTimer() { return next_timer_; }
  static void ForgetTimers() { next_timer_ = time_point::max(); }

  /// How long to wait for a timer that is due in `left`. In virtual time, the io_context looks at
  /// its timers whenever it is polled.
  static duration ToWait(duration left) {
    const auto source = source_.load(std::memory_order_relaxed);
    if (source == nullptr) {
      return left;
    }
    const time_point now = source();
    const time_point at = left < time_point::max() - now ? now + left : time_point::max();
    next_timer_ = std::min(next_timer_, at);
    return duration::zero();
  }

 private:
  static inline std::atomic<time_point (*)()> source_ = nullptr;
  static inline time_point next_timer_ = time_point::max();  // in virtual time: one thread
};

}  // namespace pheromone::links

/// How Asio finds out how long to wait.
template <>
struct boost::asio::wait_traits<pheromone::links::Clock> {
  using Clock = pheromone::links::Clock;

  static Clock::duration to_wait_duration(const Clock::duration& left) {
    return Clock::ToWait(left);
  }
  static Clock::duration to_wait_duration(const Clock::time_point& at) {
    return Clock::ToWait(at - Clock::now());
  }
};
