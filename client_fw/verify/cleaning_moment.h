// The states on the way through a moment, each once however many orders of what happens lead to it:
// five robots in one zone have thousands of orders for each of their states.
//
//   moment.Begin(state);
//   for (CleaningState next; moment.Take(&next);) {
//     ... moment.Add(successor) ...     // those from which no time has passed
//   }
//
// Robots are interchangeable, but directions on the floor are not: which zone is which counts until
// the moment is over. Not thread-safe.
#pragma once

#include <cstddef>

#include "client_fw/verify/cleaning_key.h"
#include "client_fw/verify/cleaning_world.h"
#include "client_fw/verify/state_set.h"

namespace pheromone::verify {

class MomentStates {
 public:
  /// `parts` of the search; symmetry and clock do not matter.
  MomentStates(const CleaningWorld& world, KeyParts parts, int soil_percent)
      : keys_(world, WithinMoment(parts), soil_percent), states_(keys_.words()) {}

  size_t bytes() const { return states_.bytes(); }

  void Begin(const CleaningState& first) {
    states_.Clear();
    taken_ = 0;
    first_ = first;
    has_first_ = true;
  }

  /// Whether it is new.
  bool Add(const CleaningState& state) {
    return states_.Insert(keys_.Pack(state).key.data()).second;
  }

  /// The first, then those that were added, in their order; false if there is none left.
  bool Take(CleaningState* state) {
    if (has_first_) {
      has_first_ = false;
      *state = first_;
      return true;
    }
    if (taken_ == states_.size()) {
      return false;
    }
    *state = keys_.Unpack(states_[taken_++]);
    state->clock = first_.clock;
    return true;
  }

 private:
  static KeyParts WithinMoment(KeyParts parts) {
    parts.symmetric = false;
    parts.clock = false;
    return parts;
  }

  CleaningKeys keys_;
  SmallStateSet states_;
  size_t taken_ = 0;
  CleaningState first_;
  bool has_first_ = false;
};

}  // namespace pheromone::verify
