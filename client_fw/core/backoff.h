// When to try again on a shared channel: a seeded generator and the contention window.
//
// The window starts at 8 slots, doubles on a missing answer up to 64, and shrinks by an eighth on
// success down to 8 again. A delay is a random number of slots below the window.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

constexpr uint8_t kMinWindow = 8;
constexpr uint8_t kMaxWindow = 64;

/// A linear congruential generator modulo 2^16 (multiplier and increment of Grogono) of which only
/// the high byte is used: small, and the same sequence on every machine for a seed.
class Random {
 public:
  Random(uint8_t id, uint16_t boot_counter)
      : state_(static_cast<uint16_t>((id * 0x9E37u) ^ (boot_counter * 0x6A09u))) {}

  /// From 0 to bound - 1, each as often as 256 draws allow; 0 if `bound` is 0.
  __attribute__((noinline)) uint8_t Below(uint8_t bound) {
    state_ = static_cast<uint16_t>(state_ * 25173u + 13849u);
    return static_cast<uint8_t>(((state_ >> 8) * bound) >> 8);
  }

 private:
  uint16_t state_;
};

class ContentionWindow {
 public:
  void OnMiss() {
    slots_ = slots_ >= kMaxWindow / 2 ? kMaxWindow : static_cast<uint8_t>(slots_ * 2);
  }

  void OnSuccess() {
    slots_ = static_cast<uint8_t>(slots_ - slots_ / 8);
    if (slots_ < kMinWindow) {
      slots_ = kMinWindow;
    }
  }

  uint8_t slots() const { return slots_; }

 private:
  uint8_t slots_ = kMinWindow;
};

}  // namespace client
}  // namespace pheromone
