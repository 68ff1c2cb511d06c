// What is to be done once in a period, by a steady clock. Being late does not shift what follows,
// and what was missed is not made up for.
//
//   Due diagnostics(1000);
//   if (diagnostics.Claim(now_ms)) ...  // at 0, 1000, 2000, or at the first call after each
//
// One thread.
#pragma once

#include <cstdint>

namespace pheromone::ros2 {

class Due {
 public:
  explicit Due(int64_t period_ms) : period_ms_(period_ms) {}

  /// Whether it is due at `now_ms`, at least 0; if so, next at the next multiple of the period.
  bool Claim(int64_t now_ms) {
    if (now_ms < next_ms_) {
      return false;
    }
    next_ms_ = (now_ms / period_ms_ + 1) * period_ms_;
    return true;
  }
  int64_t next_ms() const { return next_ms_; }

 private:
  const int64_t period_ms_;
  int64_t next_ms_ = 0;
};

}  // namespace pheromone::ros2
