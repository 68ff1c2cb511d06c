// Records what passes a running server into files from which it can be replayed to the byte.
//
//   Recorder recorder({.service = &service, .utc_ns = ..., .describe = ...});
//   std::thread writer([&] { recorder.Run(); });
//   Status status = recorder.Start({.folder = "captures"});
//   ...                                          // links call BeginRead, Read, Wrote, ...
//   recorder.Stop();
//   recorder.Close(); writer.join();
//
// A link is never held up by the disk: records wait in a queue of bounded size for the thread that
// runs Run. What does not fit is left out, which the file says; it cannot be replayed from there
// on. At the beginning of each file the state is frozen, for which reads and events wait a moment;
// that thread then copies it into the file in portions, while the records that follow wait in the
// queue, which may be longer for as long (QueueBytes).
//
// The state can be frozen for one at a time (Service::Freeze). While it is for somebody else, a
// recording that was started waits, and a file that is full goes on. So does one that is started
// again while the state of the one before is being written. A copy that fails, because
// more was changed meanwhile than may be kept, makes the recording begin anew, as another one.
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
#include "server/capture/cut_lock.h"
#include "server/capture/files.h"
#include "server/capture/record.h"
#include "server/capture/underway.h"
#include "server/engine/service.h"
#include "server/engine/witness.h"

namespace pheromone::capture {

struct RecordingOptions {
  std::string folder = ".";
  /// From this size on another file is begun; but not before half of it is more than the state that
  /// it begins with.
  uint64_t file_bytes = uint64_t{64} << 20;
  uint32_t most_files = 16;  ///< kept in the folder; 0: no limit
  size_t queue_bytes = size_t{16} << 20;
  /// A state that is no larger is copied at once, which takes as long as a portion or two.
  uint64_t small_state_bytes = uint64_t{256} << 10;
  /// What a state that is copied may keep of what is changed meanwhile.
  uint64_t most_kept_bytes = engine::FrozenState::kMostKeptBytes;
};

struct RecordingStatus {
  bool recording = false;
  std::string file;              ///< the present one, or the last
  std::string error;             ///< why the last recording ended by itself; empty: it did not
  uint64_t records = 0;          ///< of this recording: put into the queue
  uint64_t lost = 0;             ///< left out
  uint64_t bytes = 0;            ///< written
  uint32_t files = 0;            ///< begun
  bool has_state = false;        ///< the first file has the state from which it goes on
  bool written = true;           ///< nothing waits for the disk
  uint64_t longest_copy_us = 0;  ///< for which reads and events waited, while a state was frozen
  uint64_t begun_anew = 0;       ///< because a state could not be copied
};

/// A conversation with robots, as a recording knows it. Owned by the link.
struct Line {
  engine::LinkIndex link = 0;
  uint32_t connection = 0;  ///< never used again on this link
  uint64_t file = 0;        ///< the recorder's: in which file it was seen last
};

class Recorder final : public engine::Witness {
 public:
  /// What a recorder needs of its server.
  struct Host {
    engine::Service* service = nullptr;  ///< outlives the recorder
    std::function<uint64_t()> utc_ns;
    /// Version, configuration and links; called at the beginning of each file.
    std::function<capture::Start()> describe;
    /// Says to the operator what nobody asked for: that a recording has ended by itself.
    std::function<void(const std::string&)> complain;
  };

  /// What was written so soon after the start may have been given before it.
  static constexpr uint64_t kStillFromBeforeNs = 10'000'000'000;

  /// How often a recording may begin anew before its first state is copied.
  static constexpr uint64_t kMostBeginnings = 8;
  /// A recording waits so long for the state to be free: so often, for so long.
  static constexpr int kWaits = 3'000;
  static constexpr int kWaitMs = 20;

  /// How long the queue may be while a state of that size is written.
  static uint64_t QueueBytes(size_t queue_bytes, uint64_t state_bytes) {
    return queue_bytes + std::min(state_bytes / 8, uint64_t{64} << 20);
  }

  explicit Recorder(Host host) : host_(std::move(host)) {}

  /// Begins a recording. Errors: there is one; the folder takes no file. What fails later ends the
  /// recording, see status().
  Status Start(const RecordingOptions& options);
  /// Ends it. What is in the queue is still written. Errors: there is none.
  Status Stop();
  RecordingStatus status() const;

  /// Writes until Close; then what is left.
  void Run();
  void Close();

  // --- For links.

  /// What is read at once, and all that comes of it up to the batch that the service gets, belongs
  /// between these, on one thread.
  void BeginRead() { reads_.lock_shared(); }
  void EndRead() { reads_.unlock_shared(); }

  /// Bytes were read on a line, whose decoder is `decoder`, and are about to be decoded at its time
  /// `read_ms`. More than once in a read only on links of datagrams.
  void Read(Line* line, std::span<const uint8_t> bytes, uint32_t read_ms,
            const protocol::FrameDecoder& decoder);

  /// Whole frames are about to be written.
  void Wrote(const Line& line, std::span<const uint8_t> bytes);
  /// A message will never be written.
  void LeftOut(engine::LinkIndex link, const protocol::Message& message);
  /// A message that was decoded is not handed to the engine; `answer` is the reason of the ERROR
  /// that the link gives for it by itself, kNone if it gives none. Inside of a read.
  void TurnedAway(engine::LinkIndex link, const protocol::Message& message,
                  protocol::Reason answer);

  /// A halt to all robots is about to be sent, of which neither log nor service know.
  void Unlogged(engine::LinkIndex link, const protocol::Message& halt);

  // --- For the service.

  void OnBatch(const engine::Stamp& stamp, engine::LinkIndex link,
               std::span<const protocol::Message> messages, std::span<const Outcome> outcomes,
               std::span<const engine::Outgoing> sent) override;
  void OnEvent(uint64_t sequence, const engine::Stamp& stamp, const engine::Event& event,
               std::span<const engine::Outgoing> sent) override;
  void OnDropped(engine::LinkIndex link, const protocol::Message& message, bool repeated) override;

 private:
  enum class Cut { kBegin, kNextFile, kEnd };

  bool MakeCut(Cut cut);
  void PushStart(capture::Start start, engine::Service::Frozen* frozen);
  bool BeginIfWanted();
  void Drop(bool begin_anew, const std::string& why);
  void StateLost();
  void Push(Record record, bool always = false);
  void Give(std::span<const engine::Outgoing> sent);
  Status WriteAll(const std::deque<Record>& records, bool* state_lost);
  Status WriteState(engine::FrozenState* frozen, bool* lost);
  Status Write(std::string* bytes);
  void Fail(const std::string& why);

  const Host host_;
  std::mutex control_;  // Start, Stop, and the cut between two files
  CutLock reads_;       // a read and its batch fall into the same file
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
  Underway underway_;
  uint64_t recording_ = 0;  // when its first file began
  uint32_t part_ = 0;
  uint64_t file_ = 0;  // counts the files of all recordings
  uint64_t batch_ = 0;
  RecordingOptions options_;
  RecordingStatus status_;
  bool closing_ = false;

  std::unique_ptr<Files> files_;  // of the thread that runs Run, as is
  uint64_t state_bytes_ = 0;      // at the beginning of the present file
  uint64_t next_cut_bytes_ = 0;   // the state was not free: the file goes on up to there
};

}  // namespace pheromone::capture
