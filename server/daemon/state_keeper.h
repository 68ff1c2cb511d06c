// Keeps the state beyond the life of the process: opens the journal, owns the threads that write it
// and make its snapshots, and closes it. Without a journal it keeps nothing, and says so.
//
// A snapshot is of the state as it is when the thread that makes it begins, and is there when the
// log has all of its events on the disk. It is made when enough was logged, and when it is asked
// for. A disk that is stuck makes it wait, and nobody else.
//
//   auto keeper = StateKeeper::Open(config.journal);
//   engine::Service service(keeper->log(), clock, keeper->start_ms(), keeper->TakeEngine());
//   keeper->Start([&] { post the release of answers }, [&] { return freeze(service); });
//   ...
//   keeper->Stop(service.StateHash());
//
// What is found, and what goes wrong, is told in the log. One thread, but for Snapshot and status,
// which any may call.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/base/result.h"
#include "server/config/config.h"
#include "server/engine/engine.h"
#include "server/engine/ordered_log.h"
#include "server/journal/local_journal.h"
#include "server/journal/posix_folder.h"
#include "server/journal/snapshot_writer.h"

namespace pheromone::daemon {

class StateKeeper {
 public:
  /// Errors: what is in the folder cannot be used.
  static Result<std::unique_ptr<StateKeeper>> Open(const config::JournalConfig& config);
  StateKeeper(const StateKeeper&) = delete;
  StateKeeper& operator=(const StateKeeper&) = delete;
  ~StateKeeper();

  engine::OrderedLog* log();
  /// What the journal held, once; not configured if it held nothing.
  engine::Engine TakeEngine() { return std::move(engine_); }
  /// The field time to go on with.
  uint64_t start_ms() const { return start_ms_; }
  /// Changes that robots were told of may be missing.
  bool state_lost() const { return state_lost_; }
  /// Empty: nothing is kept.
  const std::string& folder() const { return folder_name_; }

  /// Gives the state as it is now, from any thread; null while that is not possible.
  using Freeze = std::function<std::unique_ptr<journal::StateSource>()>;
  /// The file's path, when the snapshot is there for good.
  using SnapshotDone = std::function<void(Result<std::string>)>;
  static constexpr size_t kMaxSnapshotWaiters = 64;

  /// `on_durable` is called by a thread of its own when more has become durable. Both are used
  /// until Stop returns.
  void Start(std::function<void()> on_durable, Freeze freeze);
  /// Writes what is left. `state_hash` is that of the final state. False if not all is on the disk.
  bool Stop(uint64_t state_hash);

  /// Makes a snapshot of the state as it is now, or later: those who ask while one is made share
  /// the next one. `done` is called once, by a thread of the keeper's, and must not take long;
  /// within the call if nothing is kept or too many wait. As long as the disk is stuck it is not
  /// called. Errors: why there is none.
  void Snapshot(SnapshotDone done);
  /// Tells the log when the disk begins and ends to take nothing; to be called each second, by one
  /// thread.
  void ReportStall();

  /// Nothing if nothing is kept.
  std::optional<journal::JournalStatus> status() const;

 private:
  explicit StateKeeper(const config::JournalConfig& config);

  Status OpenFolder();
  void MakeSnapshots();
  Result<std::string> MakeSnapshot();
  std::unique_ptr<journal::StateSource> FreezeWhenPossible();
  bool AwaitDisk(uint64_t sequence);
  void EndThreads();

  const config::JournalConfig config_;
  const std::string folder_name_;
  engine::VolatileLog volatile_log_;
  std::unique_ptr<journal::PosixFolder> folder_;
  std::unique_ptr<journal::LocalJournal> journal_;
  engine::Engine engine_;
  uint64_t start_ms_ = 0;
  bool state_lost_ = false;

  uint64_t stalled_us_ = 0;  // as it was told last; 0: all is well
  Freeze freeze_;
  std::thread writer_;
  std::thread snapshot_maker_;
  std::mutex mutex_;
  std::condition_variable wake_;
  // Under mutex_:
  bool snapshot_due_ = false;
  std::vector<SnapshotDone> asked_;  // for the next snapshot
  uint64_t on_disk_ = 0;             // the log, as far as a snapshot waited for it
  bool stopping_ = false;
};

}  // namespace pheromone::daemon
