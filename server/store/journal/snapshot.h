// Snapshots: the complete state of an engine in a file, exact at one sequence.
//
//   Status written = WriteSnapshot(engine, stamp, &folder);
//   Result<Snapshot> read = ReadSnapshot(folder, SnapshotName(4711), &byte);
//
// A snapshot appears under its name once it is complete and durable; a crash leaves at most a file
// NAME.new, which is ignored. A running server uses snapshot_writer.h.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/base/result.h"
#include "server/core/engine/engine.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/format.h"

namespace pheromone::journal {

struct Snapshot {
  engine::Engine engine;
  engine::Stamp stamp;  ///< of the last event in it
};

/// Writes a snapshot of an engine that is not changed meanwhile and whose events are durable.
/// `stamp` is that of the engine's last event.
Status WriteSnapshot(const engine::Engine& engine, const engine::Stamp& stamp, Folder* folder);

/// Errors: damage, in the block that begins at `*byte`. `read` is called periodically with the
/// number of bytes read since the last call.
Result<Snapshot> ReadSnapshot(const Folder& folder, const std::string& name, uint64_t* byte,
                              const std::function<void(uint64_t)>& read = {});

}  // namespace pheromone::journal
