// Records the traffic of a running server into files that can be replayed to the byte.
//
//   Recorder recorder({.service = &service, .utc_ns = ..., .describe = ...});
//   std::thread writer([&] { recorder.Run(); });
//   Status status = recorder.Start({.folder = "captures"});
//   ...                                          // links call BeginRead, Read, Wrote, ...
//   recorder.Stop();
//   recorder.Close(); writer.join();
//
// Links never wait for the disk: records are queued for the thread that executes Run. The queue is
// bounded; records that do not fit are dropped and the file marks where, since it cannot be
// replayed from there on. At the beginning of each file the state is frozen, for which reads and
// events wait briefly; the writing thread then copies it into the file in portions, while further
// records wait in the queue, which may be longer meanwhile (QueueBytes).
//
// Only one frozen state exists at a time (Service::Freeze). While it is used for something else, a
// recording that was started waits, and a full file is continued. The same holds for a recording
// that is restarted while the state of the previous one is being written. If a copy fails because
// too much was changed meanwhile, the recording is restarted under a new name.
//
// Thread-safe. The locks, in the order in which they are taken: control_, reads_, the service's,
// mutex_.
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "protocol/decoder.h"
#include "server/base/result.h"
#include "server/core/engine/service/observer.h"
#include "server/core/engine/service/service.h"
#include "server/store/capture/files.h"
#include "server/store/capture/in_flight.h"
#include "server/store/capture/record.h"
#include "server/store/capture/rotation_lock.h"
#include "server/store/capture/written_rounds.h"

namespace pheromone::capture {

struct RecordingOptions {
  std::string folder = ".";
  /// Above this size another file is begun, but not before the file is twice as large as the state
  /// at its beginning.
  uint64_t file_bytes = uint64_t{64} << 20;
  uint32_t most_files = 16;  ///< kept in the folder; 0: no limit
  size_t queue_bytes = size_t{16} << 20;
  /// A state of at most this size is copied at once, which takes as long as one or two portions.
  uint64_t small_state_bytes = uint64_t{256} << 10;
  /// The maximum size of the old values kept while a state is copied.
  uint64_t most_kept_bytes = engine::FrozenState::kMaxKeptBytes;
};

struct RecordingStatus {
  bool recording = false;
  std::string file;              ///< the present file, or the last
  std::string error;             ///< why the last recording stopped by itself; empty if it did not
  uint64_t records = 0;          ///< queued, of this recording
  uint64_t lost = 0;             ///< dropped
  uint64_t bytes = 0;            ///< written
  uint32_t files = 0;            ///< begun
  bool has_state = false;        ///< the first file contains the initial state
  bool written = true;           ///< the queue is empty and written
  uint64_t longest_copy_us = 0;  ///< the longest time that reads and events waited for a freeze
  uint64_t begun_anew = 0;       ///< restarts because a state could not be copied
};

/// A session of a link as seen by a recording. Owned by the link.
struct Connection {
  engine::LinkIndex link = 0;
  uint32_t connection = 0;  ///< never used again on this link
  uint64_t file = 0;        ///< for the recorder: the last file in which it appears
};

class Recorder final : public engine::Observer {
 public:
  /// The recorder's interface to the server.
  struct Host {
    engine::Service* service = nullptr;  ///< outlives the recorder
    std::function<uint64_t()> utc_ns;
    /// Version, configuration and links; called at the beginning of each file.
    std::function<capture::Start()> describe;
    /// Informs the operator that a recording has stopped by itself.
    std::function<void(const std::string&)> complain;
  };

  /// A message written within this time after the start may have been given before it.
  static constexpr uint64_t kStillFromBeforeNs = 10'000'000'000;

  /// How often a recording may be restarted before its first state is copied.
  static constexpr uint64_t kMaxBeginnings = 8;
  /// A recording waits for the state to be free: this often, this long each time.
  static constexpr int kWaits = 3'000;
  static constexpr int kWaitMs = 20;

  /// The maximum size of the queue while a state of that size is written.
  static uint64_t QueueBytes(size_t queue_bytes, uint64_t state_bytes) {
    return queue_bytes + std::min(state_bytes / 8, uint64_t{64} << 20);
  }

  explicit Recorder(Host host) : host_(std::move(host)) {}

  /// Starts a recording. Errors: one is in progress; no file can be created in the folder. Later
  /// failures stop the recording, see status().
  Status Start(const RecordingOptions& options);
  /// Stops the recording. The queue is still written. Errors: no recording is in progress.
  Status Stop();
  RecordingStatus status() const;

  /// Writes until Close, and then the rest of the queue.
  void Run();
  void Close();

  // --- For links.

  /// These enclose, on one thread, one read and its processing up to the batch passed to the
  /// service.
  void BeginRead() { reads_.lock_shared(); }
  void EndRead() { reads_.unlock_shared(); }

  /// Bytes were read and are about to be pushed into `decoder` at its time `read_ms`. Called more
  /// than once in a read only on datagram links.
  void Read(Connection* line, std::span<const uint8_t> bytes, uint32_t read_ms,
            const protocol::FrameDecoder& decoder);

  /// Complete frames were written.
  void Wrote(const Connection& line, std::span<const uint8_t> bytes);
  /// A message will never be written whole.
  void Dropped(engine::LinkIndex link, const protocol::Message& message);
  /// A decoded message is rejected and not passed to the engine; `answer` is the reason of the
  /// ERROR sent by the link, kNone if none is sent. Called during a read.
  void Rejected(engine::LinkIndex link, const protocol::Message& message, protocol::Reason answer);

  /// A halt of all robots is about to be sent without the log and the service.
  void Unlogged(engine::LinkIndex link, const protocol::Message& halt);

  // --- For the service.

  void OnBatch(const engine::Stamp& stamp, engine::LinkIndex link,
               std::span<const protocol::Message> messages, std::span<const Outcome> outcomes,
               std::span<const engine::Outgoing> sent) override;
  void OnEvent(uint64_t sequence, const engine::Stamp& stamp, const engine::Event& event,
               std::span<const engine::Outgoing> sent) override;
  void OnDropped(engine::LinkIndex link, const protocol::Message& message, bool repeated) override;
  void OnFailure() noexcept override;

 private:
  enum class Cut { kBegin, kNextFile, kEnd };

  bool MakeCut(Cut cut);
  void PushStart(capture::Start start, engine::Service::Frozen* frozen);
  bool BeginIfWanted();
  void Drop(bool begin_anew, const std::string& why);
  void StateLost();
  void Push(Record record, bool always = false);
  void Give(std::span<const engine::Outgoing> sent);
  void Take(const Connection& line, const protocol::Message& written, bool still_from_before);
  Status WriteAll(const std::deque<Record>& records, bool* state_lost);
  Status WriteState(engine::FrozenState* frozen, bool* lost);
  Status Write(std::string* bytes);
  void Fail(const std::string& why);

  const Host host_;
  std::mutex control_;  // Start, Stop, and the cut between two files
  RotationLock reads_;  // a read and its batch fall into the same file
  std::atomic<bool> on_{false};

  mutable std::mutex mutex_;  // all that follows, but for files_
  std::condition_variable changed_;
  std::deque<Record> queue_;
  size_t queued_bytes_ = 0;
  size_t writing_bytes_ = 0;
  uint64_t queue_limit_ = 0;
  engine::Service::Frozen frozen_;  // of a Start in the queue: of that recording and part
  std::pair<uint64_t, uint32_t> frozen_of_;
  bool begin_wanted_ = false;  // as soon as the state is free
  uint64_t lost_here_ = 0;     // since the last record that was queued
  InFlight in_flight_;
  WrittenRounds rounds_;    // in this file
  uint64_t recording_ = 0;  // when its first file began
  uint32_t part_ = 0;
  uint64_t file_ = 0;  // counts the files of all recordings
  uint64_t batch_ = 0;
  RecordingOptions options_;
  RecordingStatus status_;
  bool closing_ = false;

  std::unique_ptr<Files> files_;  // of the thread that runs Run, as is
  uint64_t state_bytes_ = 0;      // at the beginning of the present file
  uint64_t next_cut_bytes_ = 0;   // the state was not free: the file is continued up to this size
};

}  // namespace pheromone::capture
