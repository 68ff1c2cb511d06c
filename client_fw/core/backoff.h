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

/// A linear congruential generator modulo 2^32 (multiplier and increment of Knuth and Lewis), of
/// which only the high half is used: small, and the same sequence on every machine for a seed.
class Random {
 public:
  Random(uint8_t id, uint16_t boot_counter)
      : state_((static_cast<uint32_t>(id) << 16 | boot_counter) * UINT32_C(2654435761)) {}

  /// Evenly from 0 to bound - 1; 0 if `bound` is 0.
  uint16_t Below(uint16_t bound) {
    state_ = state_ * UINT32_C(1664525) + UINT32_C(1013904223);
    return static_cast<uint16_t>((state_ >> 16) * bound >> 16);
  }

 private:
  uint32_t state_;
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
