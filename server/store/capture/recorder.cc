#include "server/store/capture/recorder.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "protocol/opcodes.h"
#include "server/store/capture/format.h"
#include "server/store/capture/partial_frame.h"

namespace pheromone::capture {
namespace {

// The approximate size of a record in the queue: only large ones matter.
size_t BytesOf(const Record& record) {
  size_t bytes = sizeof(Record) + 32;
  if (const auto* packet = std::get_if<Packet>(&record)) {
    bytes += packet->bytes.size();
  } else if (const auto* batch = std::get_if<Batch>(&record)) {
    bytes += batch->messages.size() * sizeof(Handled);
  } else if (const auto* state = std::get_if<State>(&record)) {
    bytes += state->bytes.size();
  }
  return bytes;
}

std::string Copy(std::span<const uint8_t> bytes) {
  return {bytes.begin(), bytes.end()};
}

}  // namespace

Status Recorder::Start(const RecordingOptions& options) {
  const std::lock_guard control(control_);
  std::error_code error;
  if (!std::filesystem::is_directory(options.folder, error)) {
    return Error{options.folder + ": " +
                 (error ? error.message() : std::string("is not a folder")) +
                 ", expected a folder for recordings"};
  }
  if (access(options.folder.c_str(), W_OK | X_OK) != 0) {
    return Error{options.folder + ": cannot create files: " + std::strerror(errno)};
  }
  {
    const std::lock_guard lock(mutex_);
    if (status_.recording) {
      return Error{"a recording is already in progress"};
    }
    options_ = options;
    status_ = {};
    status_.recording = true;
  }
  if (!MakeCut(Cut::kBegin)) {
    const std::lock_guard lock(mutex_);
    begin_wanted_ = true;
    changed_.notify_all();
  }
  return Ok();
}

Status Recorder::Stop() {
  const std::lock_guard control(control_);
  {
    const std::lock_guard lock(mutex_);
    if (!status_.recording) {
      return Error{"no recording is in progress"};
    }
    if (std::exchange(begin_wanted_, false)) {
      status_.recording = false;
      return Ok();
    }
  }
  MakeCut(Cut::kEnd);
  return Ok();
}

RecordingStatus Recorder::status() const {
  const std::lock_guard lock(mutex_);
  RecordingStatus status = status_;
  status.written = queued_bytes_ + writing_bytes_ == 0;
  return status;
}

// Ends the file, begins one, or both, between two events and outside of all reads. False, without a
// change, if a file was to begin and the state is frozen for another use. Under control_.
bool Recorder::MakeCut(Cut cut) {
  capture::Start start = host_.describe();
  uint64_t most_kept_bytes = 0;
  {
    const std::lock_guard lock(mutex_);
    most_kept_bytes = options_.most_kept_bytes;
  }
  const std::lock_guard no_reads(reads_);
  const uint64_t waiting_since_ns = host_.utc_ns();
  bool done = true;
  engine::Service::Frozen frozen;  // released outside the service's lock
  const auto make = [&](const engine::Engine& engine) {
    if (cut != Cut::kEnd) {
      frozen = host_.service->FreezeInside(engine, most_kept_bytes);
      done = frozen != nullptr;
    }
    if (!done) {
      return;
    }
    const std::lock_guard lock(mutex_);
    const uint64_t now_ns = host_.utc_ns();
    if (cut == Cut::kBegin) {
      recording_ = now_ns;
      part_ = 0;
      lost_here_ = 0;
      in_flight_ = {};
    } else {
      Push(End{now_ns, engine.sequence(), engine.StateHash(), in_flight_.All()}, true);
    }
    if (cut != Cut::kEnd) {
      start.utc_ns = now_ns;
      PushStart(std::move(start), &frozen);
    }
    on_ = cut != Cut::kEnd;
    status_.recording = on_;
    status_.longest_copy_us =
        std::max(status_.longest_copy_us, (host_.utc_ns() - waiting_since_ns) / 1000);
  };
  if (cut == Cut::kEnd) {
    host_.service->Detach(this, make);
  } else {
    host_.service->Attach(this, make);
  }
  if (!done && cut == Cut::kBegin) {
    host_.service->Detach(this);
  }
  changed_.notify_all();
  return done;
}

// Under mutex_ and the service's lock.
void Recorder::PushStart(capture::Start start, engine::Service::Frozen* frozen) {
  const uint64_t bytes = (*frozen)->bytes();
  start.recording = recording_;
  start.part = ++part_;
  start.under_way = in_flight_.All();
  rounds_ = {};
  start.state_bytes = bytes;
  Push(std::move(start), true);
  ++file_;
  batch_ = 0;
  queue_limit_ = options_.queue_bytes;
  if (bytes <= options_.small_state_bytes) {
    std::string state;
    while ((*frozen)->CopySome(&state)) {
    }
    Push(State{std::move(state)}, true);
    return;
  }
  queue_limit_ = QueueBytes(options_.queue_bytes, bytes);
  assert(frozen_ == nullptr);  // or the state would not have been free
  frozen_ = std::move(*frozen);
  frozen_of_ = {recording_, part_};
}

// Under mutex_. `always`: a record without which the file could not be decoded.
void Recorder::Push(Record record, bool always) {
  const size_t bytes = BytesOf(record);
  if (!always && queued_bytes_ + writing_bytes_ + bytes > queue_limit_) {
    ++lost_here_;
    ++status_.lost;
    return;
  }
  if (lost_here_ != 0) {
    queue_.emplace_back(Gap{host_.utc_ns(), std::exchange(lost_here_, 0)});
  }
  queued_bytes_ += bytes;
  ++status_.records;
  queue_.push_back(std::move(record));
  changed_.notify_all();
}

void Recorder::Read(Connection* line, std::span<const uint8_t> bytes, uint32_t read_ms,
                    const protocol::FrameDecoder& decoder) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (std::exchange(line->file, file_) != file_ && !decoder.parser().idle()) {
    Push(PartialFrame{line->link, line->connection, decoder.last_byte_ms(),
                      PartialFrameOf(decoder.parser())});
  }
  Push(Packet{host_.utc_ns(), line->link, line->connection, Direction::kFromRobots, Copy(bytes),
              read_ms});
}

void Recorder::Wrote(const Connection& line, std::span<const uint8_t> bytes) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (!on_) {
    return;
  }
  const uint64_t now_ns = host_.utc_ns();
  const bool still_from_before = now_ns - recording_ < kStillFromBeforeNs;
  protocol::FrameDecoder frames(protocol::kNoGapTimeout);
  frames.PushBlock(bytes.data(), bytes.size(), 0, [&](const protocol::Message& message) {
    Take(line, message, still_from_before);
  });
  Push(Packet{now_ns, line.link, line.connection, Direction::kToRobots, Copy(bytes), 0});
}

// Under mutex_.
void Recorder::Take(const Connection& line, const protocol::Message& written,
                    bool still_from_before) {
  std::vector<Sent> unknown;
  protocol::Round round;
  if (DecodeRound(written, &round)) {
    for (const auto& answer : rounds_.Take(line.link, line.connection, round, &in_flight_)) {
      unknown.push_back({line.link, WrittenRounds::MessageOf(answer)});
    }
  } else if (!in_flight_.Take({line.link, written}) && !in_flight_.WasLast({line.link, written})) {
    unknown.push_back({line.link, written});
  }
  for (const Sent& sent : unknown) {
    if (still_from_before) {
      Push(FromBefore{sent});
    }
  }
}

void Recorder::Dropped(engine::LinkIndex link, const protocol::Message& message) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (on_ && in_flight_.Take({link, message})) {
    Push(capture::Dropped{{link, message}});
  }
}

void Recorder::Rejected(engine::LinkIndex link, const protocol::Message& message,
                        protocol::Reason answer) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (answer != protocol::Reason::kNone) {
    in_flight_.Add({link, engine::ErrorMessage(message, answer)});
  }
  Push(capture::Rejected{link, message, answer});
}

void Recorder::Unlogged(engine::LinkIndex link, const protocol::Message& halt) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (on_) {
    in_flight_.Add({link, halt});
    Push(capture::Unlogged{{link, halt}});
  }
}

void Recorder::OnBatch(const engine::Stamp& stamp, engine::LinkIndex link,
                       std::span<const protocol::Message> messages,
                       std::span<const Outcome> outcomes, std::span<const engine::Outgoing> sent) {
  const std::lock_guard lock(mutex_);
  if (!on_) {
    return;  // it is to begin
  }
  Batch batch{++batch_, link, stamp, {}};
  batch.messages.reserve(messages.size());
  for (size_t i = 0; i < messages.size(); ++i) {
    batch.messages.push_back({messages[i], outcomes[i].sequence, outcomes[i].refused});
  }
  Push(std::move(batch));
  Give(sent);
}

void Recorder::OnEvent(uint64_t sequence, const engine::Stamp& stamp, const engine::Event& event,
                       std::span<const engine::Outgoing> sent) {
  const std::lock_guard lock(mutex_);
  if (!on_) {
    return;
  }
  Push(EventApplied{sequence, stamp, event});
  Give(sent);
}

// One of two identical messages may have been produced before the recording began: then this is not
// the known one.
void Recorder::OnDropped(engine::LinkIndex link, const protocol::Message& message, bool repeated) {
  const std::lock_guard lock(mutex_);
  const Sent sent{link, message};
  if ((!repeated || in_flight_.Count(sent) > 1) && in_flight_.Take(sent)) {
    Push(capture::Dropped{sent});
  }
}

// There was no memory for a record: the file ends before it, like a file truncated by a crash.
void Recorder::OnFailure() noexcept {
  const std::lock_guard lock(mutex_);
  on_ = false;
  ++status_.lost;
  status_.recording = begin_wanted_;
  status_.error = "out of memory";  // short enough to need no memory
}

// Under mutex_.
void Recorder::Give(std::span<const engine::Outgoing> sent) {
  for (const engine::Outgoing& one : sent) {
    in_flight_.Add({one.link, one.message});
  }
}

void Recorder::Run() {
  std::unique_lock lock(mutex_);
  int waits = 0;
  while (true) {
    changed_.wait(lock, [this] { return !queue_.empty() || closing_ || begin_wanted_; });
    if (queue_.empty()) {
      if (closing_) {
        return;
      }
      lock.unlock();
      if (BeginIfWanted()) {
        waits = 0;
      } else if (++waits < kWaits) {
        poll(nullptr, 0, kWaitMs);
      } else {
        waits = 0;
        Fail("another copy of the state has not finished within a minute");
      }
      lock.lock();
      continue;
    }
    const std::deque<Record> records = std::exchange(queue_, {});
    writing_bytes_ = std::exchange(queued_bytes_, 0);
    const uint64_t limit = options_.file_bytes;
    lock.unlock();
    bool state_lost = false;
    const Status written = WriteAll(records, &state_lost);
    if (!written.ok()) {
      Fail(written.error());
    } else if (state_lost) {
      StateLost();
    } else if (files_ != nullptr && files_->open() &&
               files_->bytes() >= std::max({limit, 2 * state_bytes_, next_cut_bytes_})) {
      const std::lock_guard control(control_);
      if (on_ && !MakeCut(Cut::kNextFile)) {
        next_cut_bytes_ = files_->bytes() + limit / 16;  // reads wait for each attempt
      }
    }
    lock.lock();
    writing_bytes_ = 0;
    if (frozen_ == nullptr && queued_bytes_ <= options_.queue_bytes) {
      queue_limit_ = options_.queue_bytes;  // the records queued meanwhile are written
    }
  }
}

// False if it must wait.
bool Recorder::BeginIfWanted() {
  const std::lock_guard control(control_);
  {
    const std::lock_guard lock(mutex_);
    if (!begin_wanted_) {
      return true;
    }
  }
  if (!MakeCut(Cut::kBegin)) {
    return false;
  }
  const std::lock_guard lock(mutex_);
  begin_wanted_ = false;
  return true;
}

// Of the writer's thread.
Status Recorder::Write(std::string* bytes) {
  Status status = Ok();
  if (!bytes->empty()) {
    status = files_->Write(*bytes);
    const std::lock_guard lock(mutex_);
    status_.bytes += status.ok() ? bytes->size() : 0;
  }
  bytes->clear();
  return status;
}

// Copies the frozen state into the file that was just begun.
Status Recorder::WriteState(engine::FrozenState* frozen, bool* lost) {
  std::string state;
  const auto write = [&](size_t at_least) {
    Status status = Ok();
    size_t at = 0;
    while (status.ok() && state.size() - at >= std::max<size_t>(at_least, 1)) {
      const size_t size = std::min(state.size() - at, kStatePortion);
      std::string bytes = EncodeRecord(State{state.substr(at, size)}, files_->TakeNumber());
      status = Write(&bytes);
      at += size;
    }
    state.erase(0, at);
    return status;
  };
  while (host_.service->CopySome(frozen, &state)) {
    Status status = write(kStatePortion);
    if (!status.ok()) {
      return status;
    }
  }
  *lost = frozen->failed();
  return *lost ? Ok() : write(1);
}

// Called by the writer's thread. After a failure, or if a state could not be copied, nothing is
// written until a new recording begins.
Status Recorder::WriteAll(const std::deque<Record>& records, bool* state_lost) {
  std::string bytes;
  Status status = Ok();
  Status earlier = Ok();  // of a file before the present one
  const auto flush = [&] {
    if (status.ok()) {
      status = Write(&bytes);
    }
  };
  for (size_t i = 0; i < records.size(); ++i) {
    const Record& record = records[i];
    const auto* start = std::get_if<capture::Start>(&record);
    engine::Service::Frozen frozen;
    if (start != nullptr) {
      flush();  // a recording that ended for want of memory has no End
      earlier = earlier.ok() ? status : earlier;
      std::unique_lock lock(mutex_);
      if (start->part == 1 || files_ == nullptr) {
        files_ = std::make_unique<Files>(options_.folder, options_.most_files);
      }
      lock.unlock();
      status = files_->Begin(*start);
      state_bytes_ = start->state_bytes;
      next_cut_bytes_ = 0;
      lock.lock();
      status_.file = files_->path();
      status_.files += status.ok() ? 1u : 0u;
      if (frozen_ != nullptr && frozen_of_ == std::pair{start->recording, start->part}) {
        frozen = std::move(frozen_);
      }
    }
    if (!status.ok() || files_ == nullptr || !files_->open()) {
      continue;
    }
    bytes += EncodeRecord(record, files_->TakeNumber());
    if (bytes.size() >= kStatePortion || start != nullptr) {
      flush();
    }
    if (frozen != nullptr && status.ok()) {
      status = WriteState(frozen.get(), state_lost);
      if (*state_lost) {
        const std::lock_guard lock(mutex_);
        status_.lost += records.size() - i - 1;
        return Ok();
      }
    }
    if (std::holds_alternative<End>(record)) {
      flush();
      files_->Close();
    }
  }
  flush();
  if (status.ok() && files_ != nullptr && files_->bytes() != 0) {
    const std::lock_guard lock(mutex_);
    status_.has_state = true;  // a start and its state come together
  }
  return status.ok() ? earlier : status;
}

// Drops the queue; the recording ends, or a new one is to begin.
void Recorder::Drop(bool begin_anew, const std::string& why) {
  engine::Service::Frozen frozen;  // let go after all locks
  const std::lock_guard control(control_);
  const std::lock_guard no_reads(reads_);
  host_.service->Detach(this, [&](const engine::Engine& /*engine*/) {
    const std::lock_guard lock(mutex_);
    const bool again = begin_anew && on_;
    const bool other = begin_anew && begin_wanted_;  // a recording that was started after this one
    begin_wanted_ = again || other;
    on_ = false;
    status_.recording = begin_wanted_;
    status_.lost += queue_.size();
    status_.begun_anew += again ? 1u : 0u;
    if (!begin_wanted_) {
      status_.error = why;
    }
    queue_.clear();
    queued_bytes_ = 0;
    frozen = std::move(frozen_);
  });
}

// The file has no state at its beginning and is useless.
void Recorder::StateLost() {
  files_->Discard();
  const RecordingStatus before = status();
  const std::string why = "the map changes faster than its state can be copied";
  const bool again = before.begun_anew < kMaxBeginnings;
  Drop(again, why);
  if (!status().recording) {
    host_.complain("the recording has ended: " + why);
  }
}

void Recorder::Fail(const std::string& why) {
  if (files_ != nullptr) {
    files_->Close();
  }
  Drop(false, why);
  host_.complain("the recording has ended: " + why);
}

void Recorder::Close() {
  const std::lock_guard lock(mutex_);
  closing_ = true;
  changed_.notify_all();
}

}  // namespace pheromone::capture
