// The writing thread's part of the journal: groups, syncs, segments, and their failures.

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "server/store/journal/local_journal.h"

namespace pheromone::journal {
namespace {

// Space reserved in addition to the queue: for marks, and a large record or a piece.
constexpr uint64_t kSlackBytes = uint64_t{256} << 10;
constexpr uint64_t kFirstWaitUs = 100'000;
constexpr uint64_t kLongestWaitUs = 30'000'000;
constexpr uint64_t kBetweenRotationsUs = 10'000'000;
constexpr uint64_t kLookAgainUs = 60'000'000;  // whether a snapshot has become due
constexpr uint64_t kBetweenNotesUs = 1'000'000;
constexpr uint64_t kNever = UINT64_MAX;

}  // namespace

// When there is something to do, if nothing is appended before; 0: now.
uint64_t LocalJournal::WorkDueUs() const {
  if (file_ == nullptr) {
    return retry_us_;
  }
  if (!queue_.empty() || piece_state_ == PieceState::kWaits) {
    return 0;
  }
  const uint64_t sync_us =
      unsynced_.empty() ? kNever : synced_us_ + settings_.sync_interval_ms * 1'000;
  const uint64_t note_us = IsNoted() ? kNever : noted_us_ + kBetweenNotesUs;
  return std::min({sync_us, note_us, has_space_ ? kNever : retry_us_});
}

bool LocalJournal::IsNoted() const {
  return note_ && note_->sequence == synced_;
}

void LocalJournal::WriteUntilStopped() {
  for (;;) {
    while (WriteOnce()) {
    }
    std::unique_lock lock(mutex_);
    if (stopped_) {
      return;
    }
    const uint64_t now_us = clock_();
    const uint64_t due_us = WorkDueUs();
    if (due_us > now_us) {
      work_.wait_for(lock, std::chrono::microseconds(std::min(due_us - now_us, kLookAgainUs)));
    }
  }
}

bool LocalJournal::WriteOnce() {
  CallForSnapshot();
  {
    const std::lock_guard lock(mutex_);
    LookForRotation();
    if (WorkDueUs() > clock_()) {
      return false;
    }
  }
  if (file_ == nullptr) {
    Recover();
    return file_ != nullptr;
  }
  if (!has_space_ && clock_() >= retry_us_) {
    Reserve(file_.get());
  }
  const bool has_more = WriteGroup(!settings_.relaxed);
  if (file_ != nullptr && !IsNoted() && clock_() >= noted_us_ + kBetweenNotesUs) {
    NoteDurable();
  }
  return has_more;
}

// After the answers were sent. If it cannot be written, the log is not affected: a recovery only
// knows less about missing events.
void LocalJournal::NoteDurable() {
  noted_us_ = clock_();
  Status written = Ok();
  if (note_file_ == nullptr) {
    note_ = ReadDurableNote(*folder_);
    auto opened = folder_->OpenSlots(std::string(kDurableName), 2 * kNoteBytes);
    written = opened.ok() ? folder_->Sync() : Status(Error{opened.error()});
    if (written.ok()) {
      note_file_ = std::move(opened).value();
    }
  }
  DurableNote next{note_ ? note_->count + 1 : 1, synced_, synced_utc_ms_};
  if (written.ok()) {
    written = note_file_->Write(NotePlace(next), EncodeNote(next));
  }
  if (written.ok()) {
    note_ = next;
  } else if (!notes_fail_) {
    tell_(true, "journal: the durability mark cannot be written: " + written.error());
  }
  notes_fail_ = !written.ok();
}

// A snapshot is due after so many bytes, or so much time; not if nothing was added to the journal.
void LocalJournal::LookForRotation() {
  status_.segment_bytes = written_bytes_;
  status_.segment_ordinal = next_ordinal_ - 1;
  if (rotation_queued_ || clock_() < rotate_after_us_) {
    return;
  }
  const bool time_is_up = clock_() - snapshot_us_ >= settings_.snapshot_ms * 1'000;
  rotation_due_ = rotation_due_ || written_bytes_ >= settings_.segment_bytes ||
                  (time_is_up && bytes_since_snapshot_ > 0);
}

// For what a replay would cost, no segment has to end: a snapshot may be of any moment.
void LocalJournal::CallForSnapshot() {
  bool is_due = false;
  {
    const std::lock_guard lock(mutex_);
    is_due = pace_.IsDue(clock_());
  }
  if (is_due && on_snapshot_due_) {
    on_snapshot_due_();
  }
}

// Writes the next chunk of the queue, if there is one, and syncs if that is due. False if there is
// nothing else to do for now.
bool LocalJournal::WriteGroup(bool must_sync) {
  const uint64_t started_us = clock_();
  bool has_more = false;
  bool is_new = false;
  std::string piece;
  {
    const std::lock_guard lock(mutex_);
    if (!queue_.empty()) {
      unsynced_.push_back(std::move(queue_.front()));
      queue_.pop_front();
      is_new = true;
      has_more = !queue_.empty();
    }
    must_sync = must_sync || queued_bytes_ >= settings_.queue_bytes / 2;
    if (piece_state_ == PieceState::kWaits && !(is_new && unsynced_.back().ends_segment)) {
      TakePiece(&piece);
      must_sync = must_sync || !piece.empty();  // otherwise the amount of unsynced data would grow
    }
  }
  if (unsynced_.empty() && piece.empty()) {
    return false;
  }
  const bool ends_segment = !unsynced_.empty() && unsynced_.back().ends_segment;
  if (is_new || !piece.empty()) {
    std::string group;
    AppendGroup(synced_, &group);
    group += is_new ? RecordsOf(unsynced_.back()) : std::string();
    group += piece;
    const Status written = file_->Append(group);
    if (!written.ok()) {
      Fail(written.error());
      return true;
    }
    written_bytes_ += group.size();
    bytes_since_snapshot_ += group.size();
  }
  must_sync =
      must_sync || ends_segment || started_us >= synced_us_ + settings_.sync_interval_ms * 1'000;
  if (must_sync && !Sync()) {
    return true;
  }
  if (!piece.empty()) {
    TellPiece(true);
  }
  Publish(started_us);
  if (ends_segment) {
    EndSegment();
  } else {
    Reserve(file_.get());
  }
  return has_more;
}

// Includes the records of large events in their places. If the pieces of such an event are not in
// this segment, because it replaces a failed one, the complete event is written.
std::string LocalJournal::RecordsOf(const Chunk& chunk) const {
  const std::string_view small = chunk.records;
  std::string all;
  size_t at = 0;
  ByteWriter scratch;
  for (const LargeEvent& it : chunk.large_events) {
    all += small.substr(at, it.at - at);
    const engine::WrittenAhead* const ahead = AheadOf(it.event);
    if (ahead != nullptr && ahead->segment == next_ordinal_ - 1) {
      AppendEventInPieces(it.sequence, it.stamp, *ahead, &all);
    } else {
      AppendEvent(it.sequence, it.stamp, it.event, &scratch, &all);
    }
    at = it.at;
  }
  all += small.substr(at);
  return all;
}

// Unless those before it are in another segment.
void LocalJournal::TakePiece(std::string* piece) {
  if (piece_segment_ == 0 || piece_segment_ == next_ordinal_ - 1) {
    piece->swap(piece_);
  } else {
    piece_state_ = PieceState::kIsElsewhere;
    piece_done_.notify_all();
  }
}

// Lets the thread that writes ahead continue or give up. A piece that no group has included yet is
// not the one that was written.
void LocalJournal::TellPiece(bool is_written) {
  const std::lock_guard lock(mutex_);
  if (piece_state_ == PieceState::kWaits && (piece_.empty() || !is_written)) {
    piece_state_ = is_written ? PieceState::kIsWritten : PieceState::kFailed;
    piece_segment_ = next_ordinal_ - 1;
    piece_done_.notify_all();
  }
}

bool LocalJournal::Sync() {
  const Status synced = file_->Sync();
  if (!synced.ok()) {
    Fail(synced.error());
    return false;
  }
  TakeSynced();
  return true;
}

// Reports what has become durable, and drops the copies kept in case of a failure.
void LocalJournal::Publish(uint64_t started_us) {
  bool is_more = false;
  {
    const std::lock_guard lock(mutex_);
    while (!unsynced_.empty() && unsynced_.front().last_sequence <= synced_) {
      queued_bytes_ -= std::min<uint64_t>(queued_bytes_, unsynced_.front().counted_bytes);
      unsynced_.pop_front();
    }
    is_more = durable_ != synced_;
    progress_us_ = is_more ? clock_() : progress_us_;
    durable_ = synced_;
    ++status_.groups;
    status_.last_group_us = clock_() - started_us;
    status_.longest_group_us = std::max(status_.longest_group_us, status_.last_group_us);
  }
  if (is_more && on_durable_) {
    on_durable_();
  }
  CallWaiters();
}

// Calls back the waiters whose events are durable, in order. A callback may wait again.
void LocalJournal::CallWaiters() {
  std::vector<Waiter> ready;
  {
    const std::lock_guard lock(mutex_);
    const auto first_ready =
        std::stable_partition(waiters_.begin(), waiters_.end(), [this](const Waiter& it) {
          return it.sequence > (it.for_disk ? durable_ : DurableForClients());
        });
    ready.assign(std::make_move_iterator(first_ready), std::make_move_iterator(waiters_.end()));
    waiters_.erase(first_ready, waiters_.end());
  }
  for (const Waiter& waiter : ready) {
    waiter.done();
  }
}

// The next segment is begun before anything is written to it. A segment without a header is
// ignored: if there is no space for one, the old segment is continued.
void LocalJournal::EndSegment() {
  rotate_after_us_ = clock_() + kBetweenRotationsUs;
  {
    const std::lock_guard lock(mutex_);
    rotation_queued_ = false;
  }
  const std::string name = SegmentName(next_ordinal_++);
  Result<std::unique_ptr<AppendFile>> next = folder_->Create(name);
  const uint64_t reserved_before = std::exchange(reserved_bytes_, 0);
  if (!next.ok() || next.value()->Reserve(settings_.queue_bytes + kSlackBytes) ==
                        AppendFile::Reserved::kNoSpace) {
    tell_(true, "journal: cannot start a new segment, continuing with the old one: " +
                    next.ErrorOr(folder_->path() + ": no space left"));
    (void)folder_->Remove(name);
    reserved_bytes_ = reserved_before;
    Reserve(file_.get());
    return;
  }
  file_->ReleaseReserve();
  file_.reset();
  const Status begun = BeginSegment(next.value().get());
  if (!begun.ok()) {
    Fail(begun.error());
    return;
  }
  file_ = std::move(next).value();
  NoteDurable();
  rotate_after_us_ = 0;
  Reserve(file_.get());
  const bool time_is_up = clock_() - snapshot_us_ >= settings_.snapshot_ms * 1'000;
  if (time_is_up || bytes_since_snapshot_ >= settings_.snapshot_bytes) {
    snapshot_us_ = clock_();
    bytes_since_snapshot_ = 0;
    if (on_snapshot_due_) {
      on_snapshot_due_();
    }
  }
}

// With this header, the segment replaces everything after `synced_` in older ones.
Status LocalJournal::BeginSegment(AppendFile* file) {
  std::string bytes =
      EncodeHeader(SegmentHeader{next_ordinal_ - 1, synced_ + 1, settings_.relaxed});
  if (!unsynced_.empty()) {
    AppendGroup(synced_, &bytes);
  }
  for (const Chunk& chunk : unsynced_) {
    bytes += RecordsOf(chunk);
  }
  Status status = file->Append(bytes);
  if (status.ok()) {
    status = file->Sync();
  }
  if (status.ok()) {
    status = folder_->Sync();
  }
  written_bytes_ = bytes.size();
  return status;
}

// Writes the missing records of the failed segment to a new one. It no longer matters whether the
// failed one contains some of them.
void LocalJournal::Recover() {
  const uint64_t started_us = clock_();
  const std::string name = SegmentName(next_ordinal_++);
  Result<std::unique_ptr<AppendFile>> file = folder_->Create(name);
  if (!file.ok()) {
    Fail(file.error());
    return;
  }
  reserved_bytes_ = 0;
  const Status begun = BeginSegment(file.value().get());
  if (!begun.ok()) {
    file.value().reset();
    (void)folder_->Remove(name);
    Fail(begun.error());
    return;
  }
  file_ = std::move(file).value();
  TakeSynced();
  NoteDurable();  // before anything is admitted: events covered by an earlier mark may be lost
  Publish(started_us);
  Reserve(file_.get());
}

// Everything that was written is on the disk.
void LocalJournal::TakeSynced() {
  for (const Chunk& chunk : unsynced_) {
    synced_ = chunk.last_sequence;
    synced_utc_ms_ = chunk.last_utc_ms.value_or(synced_utc_ms_);
  }
  synced_us_ = clock_();
}

// Reserves space for everything that may be admitted.
bool LocalJournal::Reserve(AppendFile* file) {
  const uint64_t wanted = written_bytes_ + settings_.queue_bytes + kSlackBytes;
  if (reserved_bytes_ < wanted) {
    AppendFile::Reserved reserved = file->Reserve(wanted + settings_.queue_bytes);
    uint64_t bytes = wanted + settings_.queue_bytes;
    if (reserved == AppendFile::Reserved::kNoSpace) {
      reserved = file->Reserve(wanted);
      bytes = wanted;
    }
    if (reserved == AppendFile::Reserved::kNoSpace) {
      has_space_ = false;
      BackOff();
      Say(folder_->path() + ": no space left on the disk");
      return false;
    }
    reserved_bytes_ = reserved == AppendFile::Reserved::kYes ? bytes : kNever;
  }
  has_space_ = true;
  wait_us_ = 0;
  Say("");
  return true;
}

// The contents of the segment after the last sync are unknown: it is left unchanged.
void LocalJournal::Fail(const std::string& why) {
  file_.reset();
  BackOff();
  {
    const std::lock_guard lock(mutex_);
    ++status_.failures;
    rotation_queued_ = false;
  }
  Say(why);
  TellPiece(false);
}

void LocalJournal::BackOff() {
  wait_us_ = wait_us_ == 0 ? kFirstWaitUs : std::min(2 * wait_us_, kLongestWaitUs);
  retry_us_ = clock_() + wait_us_;
}

// Reports a problem, or its end; only when it changes.
void LocalJournal::Say(const std::string& problem) {
  bool was_begun = true;
  {
    const std::lock_guard lock(mutex_);
    if (status_.problem == problem && status_.healthy == problem.empty()) {
      return;
    }
    was_begun = status_.problem != kNotBegun;
    status_.problem = problem;
    status_.healthy = problem.empty();
    admits_ = problem.empty();
  }
  if (!problem.empty()) {
    tell_(true, "journal: changes are refused: " + problem);
  } else if (was_begun) {
    tell_(false, "journal: changes are accepted again");
  }
}

}  // namespace pheromone::journal
