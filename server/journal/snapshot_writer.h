// A snapshot's file as it comes to be: NAME.new is written and synced, and gets its name when the
// log, too, has all of its events on the disk.
//
//   auto written = SnapshotWriter::Write(&source, folder);      // outside of the service's lock
//   ... wait until the log is on the disk up to written.value()->sequence() ...
//   Status named = written.value()->GiveName();
//
// The state comes from a StateSource, which holds it still at one sequence while the server goes
// on. The live server and the tests that cut the power use the same writer.
//
// A snapshot must not be named before its events are durable: whoever found it would take them for
// acknowledged. What has no name when its writer goes, or when the process dies, is removed.
//
// One thread at a time; the folder outlives the writer.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/engine/engine.h"
#include "server/journal/folder.h"
#include "server/journal/format.h"

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

  /// What comes next, of any length; empty: that was all. Errors: why the state cannot be given to
  /// its end.
  virtual Result<std::string> Next() = 0;

  /// After an error of Next: whether the state of a later moment may go through.
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
  /// Writes all of it, and syncs. Errors: the state cannot be given, or the file not written; then
  /// nothing is left of it.
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

  /// After End. When this returns without an error, the snapshot is there for good.
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
