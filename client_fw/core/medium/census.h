// How many other robots are on the channel: those that were heard in the last complete census or
// in this one, whichever are more. The conversation widens its contention window and stretches its
// period by it, and calls Begin every four seconds, in which every robot in range is heard.
//
//   census.Hear(id);                // each valid frame of or to another robot
//   census.Begin();                 // every kCensusMs
//   window.OnMiss(census.robots());
//
// Plain memory: Census() has heard nobody. One loop; no errors.
#pragma once

#include <stdint.h>

#include "protocol/frame.h"

namespace pheromone {
namespace client {

constexpr uint16_t kCensusMs = 4000;  ///< the length of one

class Census {
 public:
  /// `id` is in the header of a frame. The broadcast ID is no robot's.
  void Hear(uint8_t id) {
    uint8_t& eight = heard_[id / 8];
    const uint8_t bit = static_cast<uint8_t>(1u << (id % 8));
    if (id != protocol::kBroadcastId && (eight & bit) == 0) {
      eight = static_cast<uint8_t>(eight | bit);
      ++counted_;
      if (counted_ > robots_) {
        robots_ = counted_;
      }
    }
  }

  /// The census ends, and the next one begins.
  void Begin() {
    robots_ = counted_;
    counted_ = 0;
    for (uint8_t& eight : heard_) {
      eight = 0;
    }
  }

  /// Other robots, 0 to 254.
  uint8_t robots() const { return robots_; }

 private:
  uint8_t robots_;
  uint8_t counted_;    // in this census
  uint8_t heard_[32];  // in this census: a bit for each ID
};

}  // namespace client
}  // namespace pheromone
