#include "server/store/journal/local_journal.h"

#include <chrono>
#include <cstdio>
#include <utility>

#include "server/core/engine/event_codec.h"
#include "server/store/journal/crc32c.h"

namespace pheromone::journal {
using protocol::Reason;

namespace {

constexpr uint64_t kLargeEventBytes = 1'024;  // an edit of 64 points is less
constexpr uint64_t kStalledUs = 1'000'000;    // after this time it is reported
constexpr std::chrono::seconds kGiveUpPiece{10};

}  // namespace

LocalJournal::LocalJournal(Folder* folder, const JournalSettings& settings, ReadMicroseconds clock,
                           Tell tell, Start start)
    : folder_(folder),
      settings_(settings),
      clock_(std::move(clock)),
      tell_(std::move(tell)),
      appended_(start.sequence),
      durable_(start.certain),
      pace_(settings.snapshot_cost, start.cost_since_snapshot),
      next_ordinal_(start.ordinal),
      synced_(start.certain),
      snapshot_us_(clock_()),
      bytes_since_snapshot_(start.bytes_since_snapshot),
      synced_utc_ms_(start.utc_ms) {
  progress_us_ = snapshot_us_;
  if (start.sequence > start.certain) {
    queued_bytes_ = start.tail.size();
    Chunk& tail = unsynced_.emplace_back();
    tail.records = std::move(start.tail);
    tail.last_sequence = start.sequence;
    tail.counted_bytes = queued_bytes_;
  }
  status_.healthy = false;
  status_.problem = std::string(kNotBegun);
}

const engine::WrittenAhead* LocalJournal::AheadOf(const engine::Event& event) {
  const auto* const changed = std::get_if<engine::ConfigChanged>(&event);
  return changed != nullptr ? changed->ahead.get() : nullptr;
}

// --- An operator's thread.

Status LocalJournal::WriteAhead(engine::Event* event) {
  auto* const changed = std::get_if<engine::ConfigChanged>(event);
  if (changed == nullptr || engine::EncodedBytesAtMost(*event) <= settings_.piece_bytes) {
    return Ok();
  }
  ByteWriter writer;
  engine::EncodeEvent(*event, &writer);
  const std::string_view bytes = writer.bytes();
  auto ahead = std::make_shared<engine::WrittenAhead>();
  ahead->bytes = bytes.size();
  ahead->checksum = Crc32c(bytes);
  {
    const std::lock_guard lock(mutex_);
    ahead_ = ahead;
  }
  for (size_t at = 0; at < bytes.size();) {
    std::string piece;
    AppendPiece(at, bytes.substr(at, settings_.piece_bytes), &piece);
    const Result<uint64_t> segment = WritePiece(std::move(piece), at == 0 ? 0 : ahead->segment);
    if (!segment.ok()) {
      return segment.error();
    }
    // A segment that was begun meanwhile must contain all pieces.
    at = segment.value() != 0 ? at + settings_.piece_bytes : 0;
    ahead->segment = segment.value();
  }
  changed->ahead = std::move(ahead);
  return Ok();
}

// Waits until the writing thread has added it to a group. Returns its segment, or 0 if the present
// one is not `segment`; a `segment` of 0 is any.
Result<uint64_t> LocalJournal::WritePiece(std::string piece, uint64_t segment) {
  std::unique_lock lock(mutex_);
  if (!admits_) {
    return Error{"changes are refused: " + status_.problem};
  }
  piece_ = std::move(piece);
  piece_segment_ = segment;
  piece_state_ = PieceState::kWaits;
  work_.notify_one();
  piece_done_.wait_for(lock, kGiveUpPiece,
                       [this] { return piece_state_ != PieceState::kWaits || stopped_; });
  switch (std::exchange(piece_state_, PieceState::kNone)) {
    case PieceState::kIsWritten:
      return piece_segment_;
    case PieceState::kIsElsewhere:
      return uint64_t{0};
    case PieceState::kFailed:
      return Error{"changes are refused: " + status_.problem};
    default:
      return Error{stopped_ ? "the journal is being closed" : "no response from the disk for 10 s"};
  }
}

// --- Under the service's lock.

Reason LocalJournal::Admit() {
  const std::lock_guard lock(mutex_);
  if (!admits_) {
    return Reason::kReadOnly;
  }
  return queued_bytes_ < settings_.queue_bytes ? Reason::kNone : Reason::kBusy;
}

uint64_t LocalJournal::Append(const engine::Stamp& stamp, const engine::Event& event) {
  const std::lock_guard lock(mutex_);
  if (queue_.empty() || queue_.back().ends_segment) {
    queue_.emplace_back();
  }
  Chunk& chunk = queue_.back();
  if (appended_ == durable_) {
    progress_us_ = clock_();
  }
  uint64_t bytes = engine::EncodedBytesAtMost(event);
  ++appended_;
  const bool is_ahead = AheadOf(event) != nullptr;
  if (bytes > kLargeEventBytes || is_ahead) {
    chunk.large_events.push_back({chunk.records.size(), appended_, stamp, event});
    bytes = is_ahead ? kLargeEventBytes : bytes;
    ahead_.reset();  // a segment that ends from here on has the event
  } else {
    const size_t before = chunk.records.size();
    AppendEvent(appended_, stamp, event, &scratch_, &chunk.records);
    bytes = chunk.records.size() - before;
  }
  chunk.last_sequence = appended_;
  chunk.last_utc_ms = stamp.utc_ms;
  chunk.counted_bytes += bytes;
  queued_bytes_ += bytes;
  work_.notify_one();
  return appended_;
}

void LocalJournal::Account(uint64_t cost) {
  const std::lock_guard lock(mutex_);
  pace_.Add(cost);
}

uint64_t LocalJournal::DurableSequence() const {
  const std::lock_guard lock(mutex_);
  return DurableForClients();
}

bool LocalJournal::IsRotationDue() const {
  const std::lock_guard lock(mutex_);
  return rotation_due_ && admits_ && ahead_.expired();
}

void LocalJournal::Rotate(uint64_t state_hash) {
  const std::lock_guard lock(mutex_);
  rotation_due_ = false;
  rotation_queued_ = true;
  if (queue_.empty() || queue_.back().ends_segment) {
    queue_.emplace_back().last_sequence = appended_;
  }
  AppendHash(appended_, state_hash, &queue_.back().records);
  queue_.back().ends_segment = true;
  work_.notify_one();
}

// --- Any thread.

bool LocalJournal::WhenDurable(uint64_t sequence, std::function<void()> done) {
  {
    const std::lock_guard lock(mutex_);
    if (sequence > DurableForClients()) {
      if (waiters_.size() >= kMaxDurableWaiters) {
        return false;
      }
      waiters_.push_back({sequence, false, std::move(done)});
      return true;
    }
  }
  done();
  return true;
}

void LocalJournal::WhenOnDisk(uint64_t sequence, std::function<void()> done) {
  {
    const std::lock_guard lock(mutex_);
    if (sequence > durable_) {
      waiters_.push_back({sequence, true, std::move(done)});
      return;
    }
  }
  done();
}

void LocalJournal::SnapshotBegins() {
  const std::lock_guard lock(mutex_);
  pace_.Begin(clock_());
}

void LocalJournal::SnapshotEnds(bool is_made) {
  const std::lock_guard lock(mutex_);
  pace_.End(clock_(), is_made);
}

bool LocalJournal::IsBehind() const {
  const std::lock_guard lock(mutex_);
  return pace_.IsBehind();
}

JournalStatus LocalJournal::status() const {
  const std::lock_guard lock(mutex_);
  JournalStatus status = status_;
  status.appended = appended_;
  status.durable = durable_;
  status.queued_bytes = queued_bytes_;
  const uint64_t by_design_us = settings_.relaxed ? settings_.sync_interval_ms * 1'000 : 0;
  const uint64_t now_us = clock_();
  if (appended_ > durable_ && now_us > progress_us_ + by_design_us) {
    status.stalled_us = now_us - progress_us_ - by_design_us;
  }
  return status;
}

std::string LocalJournal::Trouble() const {
  const JournalStatus now = status();
  if (!now.healthy) {
    return "changes are refused: " + now.problem;
  }
  if (now.stalled_us < kStalledUs) {
    return {};
  }
  char text[80];
  std::snprintf(text, sizeof text, "no response from the disk for %.1f s",
                static_cast<double>(now.stalled_us) / 1e6);
  return text;
}

void LocalJournal::Stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  work_.notify_one();
  piece_done_.notify_all();
}

Status LocalJournal::Close(std::optional<uint64_t> state_hash) {
  const auto flush = [this] {
    while (file_ != nullptr && WriteGroup(true)) {
    }
    return file_ != nullptr && unsynced_.empty();
  };
  if (file_ == nullptr) {
    Recover();
  }
  bool done = flush();
  if (done) {
    const std::lock_guard lock(mutex_);
    admits_ = false;
    queue_.emplace_back().last_sequence = appended_;
    if (state_hash) {
      AppendHash(appended_, *state_hash, &queue_.back().records);
    }
    AppendEnd(appended_, &queue_.back().records);
  }
  done = done && flush();
  if (!done) {
    return Error{"the journal was not closed: " + status().problem + "; durable up to sequence " +
                 std::to_string(status().durable) + " of " + std::to_string(status().appended)};
  }
  NoteDurable();
  file_->ReleaseReserve();
  file_.reset();
  return Ok();
}

}  // namespace pheromone::journal
