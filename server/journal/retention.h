// What the newest snapshots make unnecessary.
//
//   Result<uint64_t> removed = RemoveWhatIsNotNeeded(settings.keep_snapshots, folder.get());
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/base/result.h"
#include "server/journal/folder.h"

namespace pheromone::journal {

/// Removes what the newest `keep` snapshots do not need: older snapshots, and segments all of whose
/// events are in the oldest one kept. With fewer than `keep` snapshots, nothing. Only what has a
/// whole name and header is counted, and damaged files are left alone. Returns how many files went.
/// One thread at a time. Errors: what cannot be read or removed.
Result<uint64_t> RemoveWhatIsNotNeeded(size_t keep, Folder* folder);

}  // namespace pheromone::journal
