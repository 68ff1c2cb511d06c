// The state of a node when the law of its pheromone is replaced: its value is kept, and evaporates
// under the new law from then on.
//
//   LawChange change{old_law, at_ms};                    // from `at_ms` on, a new law applies
//   NodeState now = Rebased(&change, new_law, stored);   // what `stored` means under it
//
// Nothing has to be rewritten at the moment of the change: the time stored in a node tells under
// which law it was stored, since everything stored from `at_ms` on has at least that time. So a
// node is converted when it is next changed, and a pass in bounded portions (Field::Advance)
// converts the others.
//
// Pure; any thread.
#pragma once

#include <cstdint>

#include "server/core/field/law.h"

namespace pheromone::field {

struct LawChange {
  PheromoneLaw from;
  uint64_t at_ms = 0;  ///< the first time under the new law
};

/// Whether a stored node has the same meaning under both laws, so that nodes need no conversion.
bool SameSubstance(const PheromoneLaw& a, const PheromoneLaw& b);

/// Converts a level under `from` to one under `to`: rounded to nearest, to whole quanta if the law
/// counts these, and at most the maximum of a node.
uint32_t LevelUnder(const PheromoneLaw& from, const PheromoneLaw& to, uint32_t level);

/// Converts a stored state to one under `present`; unchanged if `change` is null.
inline NodeState Rebased(const LawChange* change, const PheromoneLaw& present, NodeState stored) {
  if (change == nullptr || stored.time_ms >= change->at_ms || stored.level == 0) {
    return stored;
  }
  const uint32_t level = LevelAt(change->from, stored, change->at_ms);
  return {LevelUnder(change->from, present, level), change->at_ms};
}

/// The law under which a state was stored.
inline const PheromoneLaw& LawOf(const LawChange* change, const PheromoneLaw& present,
                                 NodeState stored) {
  return change != nullptr && stored.time_ms < change->at_ms ? change->from : present;
}

}  // namespace pheromone::field
