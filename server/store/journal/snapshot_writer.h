// Writes a snapshot file: NAME.new is written and synced, and renamed once all of its events are
// durable in the log.
//
//   auto written = SnapshotWriter::Write(&source, folder);      // outside of the service's lock
//   ... wait until the log is on the disk up to written.value()->sequence() ...
//   Status named = written.value()->GiveName();
//
// The state comes from a StateSource, which freezes it at one sequence while the server continues.
// The live server and the tests of power failures use the same writer.
//
// A snapshot must not be renamed before its events are durable: recovery would take them for
// acknowledged. An unfinished file is removed by the destructor, or at the next start.
//
// One thread at a time; the folder outlives the writer.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/core/engine/engine.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/format.h"

namespace pheromone::journal {

/// A state as it was at one sequence, in portions: joined, they are what Engine::Save writes.
class StateSource {
 public:
  StateSource() = default;
  StateSource(const StateSource&) = delete;
  StateSource& operator=(const StateSource&) = delete;
  virtual ~StateSource() = default;

  /// Known before the first portion.
  virtual SnapshotHeader header() const = 0;

  /// The next portion, of any length; empty at the end. Errors: the rest of the state is not
  /// available.
  virtual Result<std::string> Next() = 0;

  /// After an error of Next: whether a retry with a later state may succeed.
  virtual bool ShouldTryAgain() const { return false; }
};

/// An engine's state, copied as a whole when this is made.
class CopiedState final : public StateSource {
 public:
  /// `stamp` is that of the engine's last event.
  CopiedState(const engine::Engine& engine, const engine::Stamp& stamp);

  SnapshotHeader header() const override { return header_; }
  Result<std::string> Next() override;

 private:
  SnapshotHeader header_;
  std::string bytes_;
};

class SnapshotWriter {
 public:
  /// Writes and syncs the complete file. Errors: the state is not available, or the file cannot be
  /// written; the file is then removed.
  static Result<std::unique_ptr<SnapshotWriter>> Write(StateSource* source, Folder* folder);

  /// In steps: Begin, Append all portions, End.
  static Result<std::unique_ptr<SnapshotWriter>> Begin(const SnapshotHeader& header,
                                                       Folder* folder);
  Status Append(std::string_view bytes);
  Status End();

  SnapshotWriter(const SnapshotWriter&) = delete;
  SnapshotWriter& operator=(const SnapshotWriter&) = delete;
  ~SnapshotWriter();

  uint64_t sequence() const { return sequence_; }
  /// Without its folder.
  const std::string& name() const { return name_; }

  /// Called after End. When this returns without an error, the snapshot is durable.
  Status GiveName();

 private:
  SnapshotWriter(uint64_t sequence, Folder* folder);

  Folder* folder_;
  const uint64_t sequence_;
  const std::string name_;
  const std::string unfinished_;
  std::unique_ptr<AppendFile> file_;  // null: nothing was made, or it is written to its end
  bool is_there_ = false;             // under its unfinished name
  uint32_t portions_ = 0;
  uint64_t unsynced_bytes_ = 0;
};

}  // namespace pheromone::journal
