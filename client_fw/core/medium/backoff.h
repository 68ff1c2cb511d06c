// Random delays on a shared channel: a seeded generator and the contention window.
//
// The window starts at 8 slots, doubles when an answer is missing, up to 8 slots plus 2 for each
// other robot heard and 254 in all, and shrinks by an eighth on success, down to 8. A delay is a
// random number of slots below the window. (After Bianchi 2000 the best window is in proportion to
// the number of stations; 2 slots each suit turnarounds of 2 and of 20 ms.)
#pragma once

#include <stdint.h>

#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {

constexpr uint8_t kMinWindow = 8;
constexpr uint8_t kMaxWindow = 254;  // so that one slot more can be counted in 8 bits

/// A linear congruential generator modulo 2^16 (multiplier of Grogono) of which only the high byte
/// is used: small, and the same sequence on every machine for a seed. Its increment grows by the ID
/// with every draw: with a fixed one, two robots whose states once became equal would draw the same
/// delays after each collision, and so collide for ever.
class Random {
 public:
  Random(uint8_t id, uint16_t boot_counter)
      : state_(static_cast<uint16_t>((id * 0x9E37u) ^ (boot_counter * 0x6A09u))), step_(id) {}

  /// From 0 to bound - 1, as evenly as 256 values permit; 0 if `bound` is 0.
  PHEROMONE_OUTLINED uint8_t Below(uint8_t bound) {
    increment_ = static_cast<uint16_t>(increment_ + step_);
    state_ = static_cast<uint16_t>(state_ * 25173u + increment_);
    return static_cast<uint8_t>(((state_ >> 8) * bound) >> 8);
  }

 private:
  uint16_t state_;
  uint16_t increment_ = 13849;
  uint8_t step_;
};

class ContentionWindow {
 public:
  /// `others`: the number of other robots on the channel.
  void OnMiss(uint8_t others) {
    uint16_t most = static_cast<uint16_t>(kMinWindow + 2u * others);
    if (most > kMaxWindow) {
      most = kMaxWindow;
    }
    const uint16_t doubled = static_cast<uint16_t>(2u * slots_);
    slots_ = static_cast<uint8_t>(doubled < most ? doubled : most);
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
