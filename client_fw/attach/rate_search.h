// At which bit rate a Pioneer's port is. It begins at 9600 when it is switched on; a program that
// used it before, such as ARIA, may have left it at another one.
//
//   RateSearch search(9600);
//   if (const uint32_t rate = search.Next(port.up() && !session, now_ms)) port.SetBaud(rate);
//
// The rates that ARIA tries, the one that was given first, again and again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pheromone::attach {

class RateSearch {
 public:
  /// How long a robot has to answer at a rate.
  static constexpr int64_t kTryMs = 2500;
  static constexpr std::array<uint32_t, 5> kRates = {9600, 38'400, 19'200, 115'200, 57'600};

  explicit RateSearch(uint32_t first) : first_(first), rate_(first) {}

  /// `silent`: the port is open, and no robot has answered. The rate to try now, if it is another.
  uint32_t Next(bool silent, int64_t now_ms) {
    if (!silent) {
      since_ms_ = now_ms;
      return 0;
    }
    if (now_ms - since_ms_ < kTryMs) {
      return 0;
    }
    since_ms_ = now_ms;
    do {
      next_ = (next_ + 1) % (kRates.size() + 1);
      rate_ = next_ == 0 ? first_ : kRates[next_ - 1];
    } while (next_ != 0 && rate_ == first_);
    return rate_;
  }

  uint32_t rate() const { return rate_; }

 private:
  uint32_t first_;
  uint32_t rate_;
  size_t next_ = 0;  // 0: first_, else kRates[next_ - 1]
  int64_t since_ms_ = 0;
};

}  // namespace pheromone::attach
