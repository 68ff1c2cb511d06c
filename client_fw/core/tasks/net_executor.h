// A safe Petri net that a robot carries: at most 32 places of one token, as bits.
//
//   const NetTransition robot[] = {{1u << 0, 1u << 1, 0}, ...};  // takes, gives, inhibited by
//   uint32_t marking = 1u << 0;
//   if (Fire(robot[3], &marking) == Firing::kFired) ...  // or nothing has changed
//
// A read arc takes and gives back. The rule is that of server/core/petri: enabled, and no place
// gets a second token (Ferreira et al. 2018, section 3: the next marking has to be legal, else it
// is an exception). The same bits on every chip: the tests fire the same nets on all of them.
//
// Pure functions; any thread, any interrupt.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

constexpr uint8_t kMaxNetPlaces = 32;
constexpr uint8_t kMaxNetTransitions = 32;

/// Places as bits: place p is 1 << p.
struct NetTransition {
  uint32_t takes;
  uint32_t gives;
  uint32_t inhibited_by;
};

/// Why a transition is not fired: the first that applies.
enum class Firing : uint8_t {
  kFired,
  kNotEnabled,  ///< a token is missing
  kInhibited,
  kUnsafe,  ///< a place would have two tokens
};

/// Fires the transition, or leaves the marking as it is.
Firing Fire(const NetTransition& transition, uint32_t* marking);

}  // namespace client
}  // namespace pheromone
