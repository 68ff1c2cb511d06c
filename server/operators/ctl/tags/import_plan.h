// Which facts of a file are written on a tag, and where, so that of those that it has and those
// that the file brings the latest remain. Worked out before anything is written: if it were left to
// the tag's drop policy, one fact after the other, a fact that is there could be dropped for an
// older one, and a second import would change what the first one left.
//
//   ImportPlan plan = PlanImport(slots, {{.index = 0, .time_key = 1'138'458'000}});
//   for (const PlannedWrite& it : plan.writes) ...
//
// Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pheromone::ctl {

/// A slot of the tag as it is.
struct PresentSlot {
  enum class Content { kEmpty, kProtected, kDroppable } content = Content::kEmpty;
  int64_t time_key = 0;  ///< tags::AgeKey of its block
};

/// A fact that is not on the tag yet.
struct ImportedFact {
  size_t index = 0;  ///< the caller's
  int64_t time_key = 0;
};

struct PlannedWrite {
  size_t index = 0;  ///< of the fact
  size_t slot = 0;
};

struct ImportPlan {
  std::vector<PlannedWrite> writes;  ///< each into a slot of its own
  size_t unfit = 0;                  ///< facts that are older than all that the tag may drop
  bool all_protected = false;        ///< the tag may drop nothing
};

/// The latest first, each into an empty slot, or that of the oldest block which is older than the
/// fact and not protected; of equals, the first.
ImportPlan PlanImport(const std::vector<PresentSlot>& slots, std::vector<ImportedFact> facts);

}  // namespace pheromone::ctl
