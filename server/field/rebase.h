// How a node goes on when the law of its pheromone is replaced: its value stays, and evaporates
// under the new law from then on.
//
//   LawChange change{old_law, at_ms};                    // from `at_ms` on, another law rules
//   NodeState now = Rebased(&change, new_law, stored);   // what `stored` means under it
//
// Nothing has to be rewritten at the moment of the change: a node's own time tells under which law
// it was stored, because all that is stored from `at_ms` on bears at least that time. So a node is
// read again when it is next touched, and a walk in bounded portions (Field::Advance) rewrites the
// others.
//
// Pure; any thread.
#pragma once

#include <cstdint>

#include "server/field/law.h"

namespace pheromone::field {

struct LawChange {
  PheromoneLaw from;
  uint64_t at_ms = 0;  ///< the first time under the new law
};

/// Whether both describe the same content of a node: only then does a changed law leave the nodes
/// as they are.
bool SameSubstance(const PheromoneLaw& a, const PheromoneLaw& b);

/// A level under `from` as one under `to`: to the nearest, whole quanta where that is what the law
/// counts, at most what a node holds.
uint32_t LevelUnder(const PheromoneLaw& from, const PheromoneLaw& to, uint32_t level);

/// A stored state as one under `present`. `change` may be null: then it is that already.
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
