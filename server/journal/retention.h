// New snapshots out of old ones, and what is not needed any more.
//
//   Status made = MakeSnapshot(before_ordinal, settings.keep_snapshots, folder.get());
//
// A snapshot is made beside the running server, without its lock: a second engine follows the log,
// from the last snapshot over the segments that are complete. Each of those ends with the hash of
// the state that the server had then; only a follower that has come to the same one is written.
// While it works it takes as much memory as the server's own state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "server/base/result.h"
#include "server/journal/folder.h"

namespace pheromone::journal {

struct Made {
  uint64_t sequence = 0;
  uint64_t events = 0;   ///< that the follower applied
  uint64_t removed = 0;  ///< files
};

/// Takes the state to the end of the last segment below `before_ordinal`, writes it, and removes
/// what the newest `keep` snapshots do not need: older snapshots, and segments all of whose events
/// are in the oldest one kept. Only what is whole is counted, and damaged files are left alone. One
/// thread at a time. Errors: what cannot be read or written; a follower that differs.
Result<Made> MakeSnapshot(uint64_t before_ordinal, size_t keep, Folder* folder);

/// The second half alone.
Result<uint64_t> RemoveWhatIsNotNeeded(size_t keep, Folder* folder);

}  // namespace pheromone::journal
