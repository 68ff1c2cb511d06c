// The ordered log on a local disk: events are written in groups to append-only files, the segments,
// and an answer is sent once the group with its event is durable.
//
//   LocalJournal journal(folder.get(), settings, clock, tell, LocalJournal::Start{...});
//   journal.OnDurable([&] { post(release answers); });
//   std::thread writer([&] { journal.WriteUntilStopped(); });
//   engine::Service service(&journal, ...);
//   ...
//   journal.Stop();
//   writer.join();
//   journal.Close(service.StateHash());
//
// A group is whatever was appended while the previous one was being synced, without a time window.
// A change is refused before it is applied in three cases:
//
//   the queue is full                 busy: the disk does not keep up
//   the disk has no space left        read-only; space is reserved in advance, so that admitted
//                                     changes can be written
//   a write or a sync has failed      read-only; that segment is never touched again, and its
//                                     unsynced events are written to a new one before changes are
//                                     accepted again
//
// The last two are retried, with back-off of up to half a minute, until they succeed.
//
// Events with many points are queued unencoded; the writing thread encodes them, so that the
// service's lock is not held meanwhile. The bytes of a large configuration are written ahead of it:
// each group includes a fragment of them, so a robot's change waits for one fragment at most.
//
// Threads: Admit, Append, Account, IsRotationDue and Rotate under the service's lock.
// WriteUntilStopped (or, in tests, WriteOnce) in one thread of its own; everything else from any,
// WriteAhead from one other than the writing one.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/bytes.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/store/journal/durable_note.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/format.h"
#include "server/store/journal/snapshot_pace.h"

namespace pheromone::journal {

struct JournalSettings {
  bool relaxed = false;  ///< changes are acknowledged at once, and synced every sync_interval_ms
  uint64_t segment_bytes = uint64_t{64} << 20;   ///< the size at which a new segment is begun
  uint64_t queue_bytes = uint64_t{4} << 20;      ///< approximate limit of non-durable data
  uint64_t snapshot_bytes = uint64_t{64} << 20;  ///< a snapshot is due after this much log,
  uint64_t snapshot_ms = 3'600'000;              ///< or after this much time with any log,
  /// or when a replay would cost this much (Engine::cost): a second on a PC, some seconds on a
  /// small board. By SnapshotPace.
  uint64_t snapshot_cost = uint64_t{1} << 25;
  size_t keep_snapshots = 2;
  uint64_t sync_interval_ms = 1'000;  ///< relaxed
  /// Larger events are written ahead, this much with each group. Below the reserved slack.
  size_t piece_bytes = size_t{128} << 10;
  bool operator==(const JournalSettings&) const = default;
};

/// The status of a journal, for information.
struct JournalStatus {
  bool healthy = true;
  std::string problem;  ///< why it is not healthy
  uint64_t appended = 0;
  uint64_t durable = 0;  ///< on the disk
  uint64_t queued_bytes = 0;
  uint64_t segment_ordinal = 0;
  uint64_t segment_bytes = 0;
  uint64_t groups = 0;  ///< written and synced
  uint64_t failures = 0;
  uint64_t last_group_us = 0;
  uint64_t longest_group_us = 0;
  /// How long the oldest non-durable change has waited without any progress; 0: none waits. In a
  /// relaxed journal, changes wait for sync_interval_ms by design: only the time beyond that
  /// counts.
  uint64_t stalled_us = 0;
};

class LocalJournal final : public engine::OrderedLog {
 public:
  using ReadMicroseconds = std::function<uint64_t()>;  ///< of a monotonic clock
  using Tell = std::function<void(bool is_trouble, const std::string& text)>;

  /// Where to continue, as found by Recover.
  struct Start {
    uint64_t sequence = 0;
    uint64_t certain = 0;
    std::string tail;
    uint64_t ordinal = 1;               ///< of the next segment
    uint64_t bytes_since_snapshot = 0;  ///< of segments
    uint64_t cost_since_snapshot = 0;   ///< of replaying them (Engine::cost)
    int64_t utc_ms = 0;                 ///< of the last event
  };

  /// `folder` outlives the journal. Nothing is admitted before the first WriteOnce.
  LocalJournal(Folder* folder, const JournalSettings& settings, ReadMicroseconds clock, Tell tell,
               Start start);

  /// Called by the writing thread, without any lock, when more has become durable. To be set before
  /// anything is written.
  void OnDurable(std::function<void()> call) { on_durable_ = std::move(call); }
  /// Called by the writing thread, without any lock, when a snapshot is due: a segment has ended
  /// and there is enough log, or replaying it would take long. Until SnapshotBegins, it may be
  /// called again.
  void OnSnapshotDue(std::function<void()> call) { on_snapshot_due_ = std::move(call); }

  Status WriteAhead(engine::Event* event) override;
  protocol::Reason Admit() override;
  uint64_t Append(const engine::Stamp& stamp, const engine::Event& event) override;
  void Account(uint64_t cost) override;
  uint64_t DurableSequence() const override;
  bool IsRotationDue() const override;
  void Rotate(uint64_t state_hash) override;
  /// A relaxed journal's changes count as durable when they are appended. Called back by the
  /// writing thread, after the callback of OnDurable.
  bool WhenDurable(uint64_t sequence, std::function<void()> done) override;
  std::string Trouble() const override;

  /// Like WhenDurable, but waits for the disk in a relaxed journal too, and is not bounded: it is
  /// used for snapshots, one at a time.
  void WhenOnDisk(uint64_t sequence, std::function<void()> done);

  /// To be called before the state is frozen for a snapshot, and when that is made or has failed.
  void SnapshotBegins();
  void SnapshotEnds(bool is_made);
  /// Whether changes of the map come faster than snapshots: operators have to wait, so that a
  /// recovery remains short.
  bool IsBehind() const;

  JournalStatus status() const;

  /// Writes one group, or makes one attempt to recover from an error; false if there was nothing to
  /// do.
  bool WriteOnce();
  void WriteUntilStopped();
  void Stop();

  /// Called after the writing thread has ended: writes the rest and marks an orderly end, with the
  /// hash of the state, if that is the state after the last event. Errors: not everything is
  /// durable.
  Status Close(std::optional<uint64_t> state_hash);

 private:
  static constexpr std::string_view kNotBegun = "not begun";

  // Records that are written together.
  struct Waiter {
    uint64_t sequence;
    bool for_disk;
    std::function<void()> done;
  };

  // An event that is encoded by the writing thread, since it is large.
  struct LargeEvent {
    size_t at;  // the position of its record in `records`, which does not contain it
    uint64_t sequence;
    engine::Stamp stamp;
    engine::Event event;
  };

  struct Chunk {
    std::string records;
    uint64_t last_sequence = 0;
    bool ends_segment = false;
    uint64_t counted_bytes = 0;          // in queued_bytes_
    std::optional<int64_t> last_utc_ms;  // of the last event
    std::vector<LargeEvent> large_events;
  };

  static const engine::WrittenAhead* AheadOf(const engine::Event& event);
  Result<uint64_t> WritePiece(std::string piece, uint64_t segment);

  // The writing thread's.
  uint64_t WorkDueUs() const;  // under mutex_
  void LookForRotation();      // under mutex_
  void CallForSnapshot();
  std::string RecordsOf(const Chunk& chunk) const;
  void TakePiece(std::string* piece);  // under mutex_
  void TellPiece(bool is_written);
  void CallWaiters();
  void NoteDurable();
  bool IsNoted() const;
  void TakeSynced();
  bool WriteGroup(bool must_sync);
  bool Sync();
  void EndSegment();
  void Recover();
  Status BeginSegment(AppendFile* file);
  bool Reserve(AppendFile* file);
  void Fail(const std::string& why);
  void Publish(uint64_t started_us);
  void Say(const std::string& problem);
  void BackOff();

  Folder* folder_;
  const JournalSettings settings_;
  const ReadMicroseconds clock_;
  const Tell tell_;
  std::function<void()> on_durable_;
  std::function<void()> on_snapshot_due_;

  uint64_t DurableForClients() const { return settings_.relaxed ? appended_ : durable_; }

  mutable std::mutex mutex_;
  std::condition_variable work_;
  // Under mutex_:
  std::deque<Chunk> queue_;
  uint64_t appended_;
  uint64_t durable_;          // on the disk
  uint64_t progress_us_ = 0;  // when something got there last, or the first since then was appended
  uint64_t queued_bytes_ = 0;
  bool admits_ = false;
  bool rotation_due_ = false;
  bool rotation_queued_ = false;
  bool stopped_ = false;
  std::vector<Waiter> waiters_;  // of them at most kMaxDurableWaiters not for the disk
  JournalStatus status_;
  SnapshotPace pace_;
  ByteWriter scratch_;
  // A piece that waits for its group, and its result.
  enum class PieceState : uint8_t { kNone, kWaits, kIsWritten, kIsElsewhere, kFailed };
  PieceState piece_state_ = PieceState::kNone;
  std::string piece_;
  uint64_t piece_segment_ = 0;  // where it must be written, 0: anywhere; then: where it was
  std::condition_variable piece_done_;
  std::weak_ptr<const engine::WrittenAhead> ahead_;  // while its event is expected, no segment ends

  // The writing thread's:
  std::unique_ptr<AppendFile> file_;  // null: broken, or not begun
  uint64_t next_ordinal_;
  uint64_t written_bytes_ = 0;
  uint64_t reserved_bytes_ = 0;
  bool has_space_ = true;
  std::deque<Chunk> unsynced_;  // written, or to be rewritten, and not known to be durable
  uint64_t synced_;             // the last sequence that is
  uint64_t synced_us_ = 0;
  uint64_t retry_us_ = 0;  // while broken or without space: not before this
  uint64_t wait_us_ = 0;
  uint64_t rotate_after_us_ = 0;
  uint64_t snapshot_us_;  // when one was due last
  uint64_t bytes_since_snapshot_;
  std::unique_ptr<SlotFile> note_file_;
  std::optional<DurableNote> note_;  // as it was written last
  int64_t synced_utc_ms_;            // of the last event that is synced
  uint64_t noted_us_ = 0;
  bool notes_fail_ = false;  // and this was reported
};

}  // namespace pheromone::journal
