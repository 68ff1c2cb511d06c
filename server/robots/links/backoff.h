// Exponential back-off: the delay before a retry doubles each time, up to a limit, with random
// jitter, so that many clients that lost the same server do not retry simultaneously.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <random>

namespace pheromone::links {

struct BackoffOptions {
  std::chrono::milliseconds first{500};
  std::chrono::milliseconds longest{10'000};
  uint32_t seed = 1;
};

class Backoff {
 public:
  explicit Backoff(const BackoffOptions& options)
      : options_(options), next_(options.first), random_(options.seed) {}

  /// The next delay: between three quarters and all of the present maximum.
  std::chrono::milliseconds Next() {
    const auto whole = next_.count();
    next_ = std::min(options_.longest, 2 * next_);
    return std::chrono::milliseconds(
        std::uniform_int_distribution<int64_t>(whole - whole / 4, whole)(random_));
  }

  void Reset() { next_ = options_.first; }

 private:
  BackoffOptions options_;
  std::chrono::milliseconds next_;
  std::minstd_rand random_;
};

}  // namespace pheromone::links
