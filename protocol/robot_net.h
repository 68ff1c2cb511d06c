// What the places and transitions of a robots' net do, and the hash by which records tell one net
// from another (README.md, "Records of nets").
//
//   NetHasher hash;
//   hash.AddByte(14); ... hash.AddWord(marking); ...
//   record.hash = hash.value();
//
// Freestanding; plain values; any thread.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace protocol {

/// What a robot does while a place is marked.
enum class PlaceDoes : uint8_t {
  kNothing = 0,  ///< another marked place says it
  kFollow = 1,   ///< it follows the line of the place's pheromone type
  kWait = 2,     ///< it waits for green on the tag that it has captured, then follows the line
  kChoose = 3,   ///< it takes the tag's advice, then follows the line of the trail chosen
};

/// What a robot does on a tag to fire a transition.
enum class TransitionDoes : uint8_t {
  kNothing = 0,  ///< the tag is not told
  kPresent = 1,
  kLeave = 2,
  kLeaveA = 3,  ///< only if trail A was chosen; then as kLeave
  kLeaveB = 4,
  kStoreA = 5,
  kStoreB = 6,
  kTake = 7,
};

/// FNV-1a, 32 bits (Fowler, Noll and Vo), over bytes; words are little-endian.
class NetHasher {
 public:
  void AddByte(uint8_t byte) { value_ = (value_ ^ byte) * 16777619u; }
  void AddWord(uint32_t word) {
    for (uint8_t i = 0; i < 4; ++i) {
      AddByte(static_cast<uint8_t>(word >> (8 * i)));
    }
  }
  uint32_t value() const { return value_; }

 private:
  uint32_t value_ = 2166136261u;
};

}  // namespace protocol
}  // namespace pheromone
