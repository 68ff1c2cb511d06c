// Snapshots: an engine's whole state in a file, exact at one sequence.
//
//   Status written = WriteSnapshot(engine, stamp, &folder);
//   Result<Snapshot> read = ReadSnapshot(folder, SnapshotName(4711), &byte);
//
// A snapshot appears under its name when it is complete and on the disk; a crash leaves at most a
// file NAME.new, which counts for nothing. snapshot_writer.h is for a server that runs.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/base/result.h"
#include "server/engine/engine.h"
#include "server/journal/folder.h"
#include "server/journal/format.h"

namespace pheromone::journal {

struct Snapshot {
  engine::Engine engine;
  engine::Stamp stamp;  ///< of the last event in it
};

/// Of an engine that nobody changes meanwhile, and whose events are durable: the snapshot is there
/// when this returns. `stamp` is that of the engine's last event.
Status WriteSnapshot(const engine::Engine& engine, const engine::Stamp& stamp, Folder* folder);

/// Errors: what is wrong, found in the portion that begins at `*byte`.
/// `read` is told of how many more bytes were read, now and then.
Result<Snapshot> ReadSnapshot(const Folder& folder, const std::string& name, uint64_t* byte,
                              const std::function<void(uint64_t)>& read = {});

}  // namespace pheromone::journal
