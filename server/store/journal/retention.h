// Removes the files that the newest snapshots make obsolete.
//
//   Result<uint64_t> removed = RemoveWhatIsNotNeeded(settings.keep_snapshots, folder.get());
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/base/result.h"
#include "server/store/journal/folder.h"

namespace pheromone::journal {

/// Removes files that the newest `keep` snapshots do not need: older snapshots, and segments all of
/// whose events are in the oldest snapshot kept. With fewer than `keep` snapshots, removes nothing.
/// Only files with a valid name and header count, and damaged files are left alone. Returns the
/// number of files removed. One thread at a time. Errors: a file cannot be read or removed.
Result<uint64_t> RemoveWhatIsNotNeeded(size_t keep, Folder* folder);

}  // namespace pheromone::journal
