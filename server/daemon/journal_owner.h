// Opens the journal, owns the threads that write it and make its snapshots, and closes it. Without
// a journal it keeps nothing, and logs that.
//
// A snapshot has the state at the time when its thread begins, and is complete when all of its
// events are durable. It is made after enough log, and on request. Only snapshots wait for a disk
// that is stuck.
//
//   auto journal = JournalOwner::Open(config.journal);
//   engine::Service service(journal->log(), clock, journal->start_ms(), journal->TakeEngine());
//   journal->Start([&] { post the release of answers }, [&] { return freeze(service); });
//   ...
//   journal->Stop(service.StateHash());
//
// Findings and errors are logged. One thread, except for Snapshot, EndSnapshots, IsBehind and
// membership(), which any thread may call.
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
#include "server/core/engine/engine.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/daemon/membership_keeper.h"
#include "server/store/journal/local_journal.h"
#include "server/store/journal/posix_folder.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::daemon {

class JournalOwner {
 public:
  /// `is_member`: of a cluster, whose events have the UTC of other machines. Errors: the journal in
  /// the folder cannot be used.
  static Result<std::unique_ptr<JournalOwner>> Open(const config::JournalConfig& config,
                                                    bool is_member);
  JournalOwner(const JournalOwner&) = delete;
  JournalOwner& operator=(const JournalOwner&) = delete;
  ~JournalOwner();

  engine::OrderedLog* log();
  /// The recovered engine; to be called once; not configured if the journal was empty.
  engine::Engine TakeEngine() { return std::move(engine_); }
  /// The field time to resume with.
  uint64_t start_ms() const { return start_ms_; }
  /// The last event.
  uint64_t last_sequence() const { return last_sequence_; }
  /// Its field time.
  uint64_t last_ms() const { return last_ms_; }
  /// Whether acknowledged changes may be missing.
  bool state_lost() const { return state_lost_; }

  /// As MembershipKeeper.
  std::string WhyNotFor(const std::string& cluster) const {
    return membership_.WhyNotFor(cluster, last_sequence_ == 0);
  }
  MembershipKeeper& membership() { return membership_; }

  /// Where a snapshot may be put; null: nothing is kept.
  journal::Folder* files() { return folder_.get(); }
  /// Empty: nothing is kept.
  const std::string& folder() const { return folder_name_; }

  /// Freezes the present state, from any thread; null while that is not possible.
  using Freeze = std::function<std::unique_ptr<journal::StateSource>()>;
  /// The path of the file, once the snapshot is durable.
  using SnapshotDone = std::function<void(Result<std::string>)>;
  static constexpr size_t kMaxSnapshotWaiters = 64;

  /// `on_durable` is called by a thread of its own when more has become durable. Both are used
  /// until Stop returns.
  void Start(std::function<void()> on_durable, Freeze freeze);
  /// Writes the rest. `state_hash` is that of the final state, if the journal has all of its
  /// events. False if not everything is durable.
  bool Stop(std::optional<uint64_t> state_hash);

  /// Makes a snapshot of the present state or a later one: requests during a snapshot share the
  /// next one. `done` is called once, by a thread of the journal, and must not block; it is called
  /// directly if there is no journal or too many requests wait, and not at all while the disk is
  /// stuck. Errors: why no snapshot was made.
  void Snapshot(SnapshotDone done);
  /// Returns when none is being made, and none will be: requests are refused with this reason. Any
  /// thread but the journal's.
  void EndSnapshots(const std::string& why);
  /// Logs when the disk stops responding and when it responds again; to be called each second, by
  /// one thread.
  void ReportStall();

  /// As LocalJournal::IsBehind; any thread.
  bool IsBehind() const { return journal_ != nullptr && journal_->IsBehind(); }

 private:
  JournalOwner(const config::JournalConfig& config, bool is_member);

  Status OpenFolder();
  void MakeSnapshots();
  Result<std::string> MakeSnapshot();
  std::unique_ptr<journal::StateSource> FreezeWhenPossible();
  bool AwaitDisk(uint64_t sequence);
  std::string WhyNoMore();
  void EndThreads();

  const config::JournalConfig config_;
  const bool is_member_;
  MembershipKeeper membership_;
  const std::string folder_name_;
  engine::VolatileLog volatile_log_;
  std::unique_ptr<journal::PosixFolder> folder_;
  std::unique_ptr<journal::LocalJournal> journal_;
  engine::Engine engine_;
  uint64_t start_ms_ = 0;
  uint64_t last_ms_ = 0;
  uint64_t last_sequence_ = 0;
  bool state_lost_ = false;

  uint64_t stalled_us_ = 0;  // as last reported; 0: not stalled
  Freeze freeze_;
  std::thread writer_;
  std::thread snapshot_maker_;
  std::mutex mutex_;
  std::condition_variable wake_;
  // Under mutex_:
  bool snapshot_due_ = false;
  std::vector<SnapshotDone> asked_;  // for the next snapshot
  uint64_t on_disk_ = 0;             // the log, as far as a snapshot waited for it
  bool is_making_ = false;           // a snapshot
  std::string no_more_;              // why no snapshots are made any more; empty: they are
  bool stopping_ = false;
};

}  // namespace pheromone::daemon
