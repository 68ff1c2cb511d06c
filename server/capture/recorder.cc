#include "server/capture/recorder.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "protocol/opcodes.h"
#include "server/capture/carry.h"
#include "server/capture/format.h"

namespace pheromone::capture {
namespace {

// Roughly what a record takes in the queue: the large ones count.
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
                 ", expected a folder for captures"};
  }
  if (access(options.folder.c_str(), W_OK | X_OK) != 0) {
    return Error{options.folder + ": takes no files: " + std::strerror(errno)};
  }
  {
    const std::lock_guard lock(mutex_);
    if (status_.recording) {
      return Error{"a recording is going on already"};
    }
    options_ = options;
    status_ = {};
    status_.recording = true;
    recording_ = host_.utc_ns();
    part_ = 0;
    lost_here_ = 0;
    underway_ = {};
  }
  MakeCut(Cut::kBegin);
  return Ok();
}

Status Recorder::Stop() {
  const std::lock_guard control(control_);
  {
    const std::lock_guard lock(mutex_);
    if (!status_.recording) {
      return Error{"there is no recording"};
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

// Ends the file, begins one, or both, between two events and outside of all reads.
void Recorder::MakeCut(Cut cut) {
  capture::Start start = host_.describe();
  const std::lock_guard no_reads(reads_);
  const uint64_t waiting_since_ns = host_.utc_ns();
  host_.service->Attach(cut == Cut::kEnd ? nullptr : this, [&](const engine::Engine& engine) {
    std::string state;
    if (cut != Cut::kEnd) {
      ByteWriter writer;
      engine.Save(&writer);
      state = writer.Take();
    }
    const std::lock_guard lock(mutex_);
    const uint64_t now_ns = host_.utc_ns();
    if (cut != Cut::kBegin) {
      Push(End{now_ns, engine.sequence(), engine.StateHash(), underway_.All()}, true);
    }
    if (cut != Cut::kEnd) {
      start.utc_ns = now_ns;
      start.recording = recording_;
      start.part = ++part_;
      start.under_way = underway_.All();
      start.state_bytes = state.size();
      Push(std::move(start), true);
      for (size_t at = 0; at < state.size(); at += kStatePortion) {
        Push(State{state.substr(at, kStatePortion)}, true);
      }
      ++file_;
      batch_ = 0;
    }
    on_ = cut != Cut::kEnd;
    status_.recording = on_;
    status_.longest_copy_us =
        std::max(status_.longest_copy_us, (host_.utc_ns() - waiting_since_ns) / 1000);
  });
  changed_.notify_all();
}

// Under mutex_. `always`: without it a file could not be understood at all.
void Recorder::Push(Record record, bool always) {
  const size_t bytes = BytesOf(record);
  if (!always && queued_bytes_ + writing_bytes_ + bytes > options_.queue_bytes) {
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

void Recorder::Read(Line* line, std::span<const uint8_t> bytes, uint32_t read_ms,
                    const protocol::FrameDecoder& decoder) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (std::exchange(line->file, file_) != file_ && !decoder.parser().idle()) {
    Push(Carry{line->link, line->connection, decoder.last_byte_ms(), CarryOf(decoder.parser())});
  }
  Push(Packet{host_.utc_ns(), line->link, line->connection, Direction::kFromRobots, Copy(bytes),
              read_ms});
}

void Recorder::Wrote(const Line& line, std::span<const uint8_t> bytes) {
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
    const Sent sent{line.link, message};
    if (!underway_.Take(sent) && still_from_before) {
      Push(FromBefore{sent});
    }
  });
  Push(Packet{now_ns, line.link, line.connection, Direction::kToRobots, Copy(bytes), 0});
}

void Recorder::LeftOut(engine::LinkIndex link, const protocol::Message& message) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (on_ && underway_.Take({link, message})) {
    Push(NotSent{{link, message}});
  }
}

void Recorder::TurnedAway(engine::LinkIndex link, const protocol::Message& message,
                          protocol::Reason answer) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (answer != protocol::Reason::kNone) {
    underway_.Add({link, engine::ErrorMessage(message, answer)});
  }
  Push(capture::TurnedAway{link, message, answer});
}

void Recorder::Unlogged(engine::LinkIndex link, const protocol::Message& halt) {
  if (!on_) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (on_) {
    underway_.Add({link, halt});
    Push(capture::Unlogged{{link, halt}});
  }
}

void Recorder::OnBatch(const engine::Stamp& stamp, engine::LinkIndex link,
                       std::span<const protocol::Message> messages,
                       std::span<const Outcome> outcomes, std::span<const engine::Outgoing> sent) {
  const std::lock_guard lock(mutex_);
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
  Push(EventApplied{sequence, stamp, event});
  Give(sent);
}

// One of two that are the same may have been given before the recording began: then this is not the
// one that is known here.
void Recorder::OnDropped(engine::LinkIndex link, const protocol::Message& message, bool repeated) {
  const std::lock_guard lock(mutex_);
  const Sent sent{link, message};
  if ((!repeated || underway_.Count(sent) > 1) && underway_.Take(sent)) {
    Push(NotSent{sent});
  }
}

// Under mutex_.
void Recorder::Give(std::span<const engine::Outgoing> sent) {
  for (const engine::Outgoing& one : sent) {
    underway_.Add({one.link, one.message});
  }
}

void Recorder::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return !queue_.empty() || closing_; });
    if (queue_.empty()) {
      return;
    }
    const std::deque<Record> records = std::exchange(queue_, {});
    writing_bytes_ = std::exchange(queued_bytes_, 0);
    const uint64_t limit = options_.file_bytes;
    lock.unlock();
    const Status written = WriteAll(records);
    if (!written.ok()) {
      Fail(written.error());
    } else if (files_ != nullptr && files_->open() &&
               files_->bytes() >= std::max(limit, 2 * state_bytes_)) {
      const std::lock_guard control(control_);
      if (on_) {
        MakeCut(Cut::kNextFile);
      }
    }
    lock.lock();
    writing_bytes_ = 0;
  }
}

// Of the writer's thread. After a failure nothing is written until a recording begins anew.
Status Recorder::WriteAll(const std::deque<Record>& records) {
  std::string bytes;
  Status status = Ok();
  const auto flush = [&] {
    if (status.ok() && !bytes.empty()) {
      status = files_->Write(bytes);
      const std::lock_guard lock(mutex_);
      status_.bytes += status.ok() ? bytes.size() : 0;
    }
    bytes.clear();
  };
  for (const Record& record : records) {
    if (const auto* start = std::get_if<capture::Start>(&record)) {
      std::unique_lock lock(mutex_);
      if (start->part == 1 || files_ == nullptr) {
        files_ = std::make_unique<Files>(options_.folder, options_.most_files);
      }
      lock.unlock();
      status = files_->Begin(*start);
      state_bytes_ = start->state_bytes;
      lock.lock();
      status_.file = files_->path();
      status_.files += status.ok() ? 1u : 0u;
    }
    if (!status.ok() || files_ == nullptr || !files_->open()) {
      continue;
    }
    bytes += EncodeRecord(record, files_->TakeNumber());
    if (bytes.size() >= kStatePortion) {
      flush();
    }
    if (std::holds_alternative<End>(record)) {
      flush();
      files_->Close();
    }
  }
  flush();
  return status;
}

void Recorder::Fail(const std::string& why) {
  files_->Close();
  const std::lock_guard control(control_);
  const std::lock_guard no_reads(reads_);
  host_.service->Attach(nullptr, [&](const engine::Engine& /*engine*/) {
    const std::lock_guard lock(mutex_);
    on_ = false;
    status_.recording = false;
    status_.error = why;
    queue_.clear();
    queued_bytes_ = 0;
  });
  host_.complain("the recording has ended: " + why);
}

void Recorder::Close() {
  const std::lock_guard lock(mutex_);
  closing_ = true;
  changed_.notify_all();
}

}  // namespace pheromone::capture
