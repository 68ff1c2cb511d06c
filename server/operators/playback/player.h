// Walks an engine through a recording: forwards in bounded portions, and to any moment of it.
//
//   Player player("lab.pcapng", [&](uint64_t from) { return capture::OpenFile(path, from); });
//   while (!player.Survey(kPortion)) {}               // what it covers: player.range()
//   player.Seek(player.range().begin_ns + 60'000'000'000);
//   while (!player.Arrive(kPortion)) {}               // or in between, do something else
//   if (player.has_views()) Show(player.Field(), player.Clients());
//
// Its time is the recording's: UTC in nanoseconds. It never decreases from record to record; where
// the server's clock was set back, it stands still until the clock has caught up. Between two
// records the field's time goes on, so that pheromones evaporate.
//
// Every record is checked as in a replay (server/store/capture/replay.h). Damage is no failure: the
// range ends before it, and `problem` names it. A file that is still being written is covered up to
// its end at the time of the survey.
//
// Memory: the engine, which is as large as the recorded server's; and copies of it to go back to,
// at most kMaxCheckpoints and kCheckpointBytes. Without threads and clocks; one thread at a time.
// Work is bounded in bytes of the file, except for the initial state and the copies, which are one
// portion each.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/core/engine/service/traffic.h"
#include "server/operators/control/control.h"
#include "server/store/capture/reader.h"
#include "server/store/capture/replay.h"

namespace pheromone::playback {

/// What a recording covers.
struct Range {
  uint64_t begin_ns = 0;
  uint64_t end_ns = 0;
};

struct PlayerOptions {
  size_t max_checkpoints = 16;
  uint64_t checkpoint_bytes = uint64_t{64} << 20;  ///< of the map, in all checkpoints together
  /// Called with each record after it was replayed.
  std::function<void(const capture::Record&)> on_record = nullptr;
  /// Called before that with each message that the engine gives for it.
  std::function<void(const capture::Sent&)> on_answer = nullptr;
};

class Player {
 public:
  /// Opens the file at an offset.
  using Open = std::function<Result<ByteReader::Source>(uint64_t from)>;

  /// `name` is the name of the file in messages.
  Player(std::string name, Open open, PlayerOptions options = {});

  /// Reads about so much of the file to learn what it covers; true once it is done. First.
  bool Survey(uint64_t most_bytes);
  /// After the survey.
  const Range& range() const { return range_; }
  /// Why the recording cannot be replayed beyond the present moment, or is incomplete: with file,
  /// position and reason. Empty: it can be replayed to its end.
  const std::string& problem() const {
    return replay_problem_.empty() ? problem_ : replay_problem_;
  }
  /// Whether what came so far cannot be replayed: it is not going on.
  bool has_failed() const { return !replay_problem_.empty(); }

  /// Moves to a moment, which is brought into the range: there it will be after some calls of
  /// Arrive.
  void Seek(uint64_t time_ns);
  /// The same for a moment that is not before the present one, which is reached record by record.
  void Proceed(uint64_t time_ns);
  /// Replays about so much of the file; true once it is there, or where the recording ends.
  bool Arrive(uint64_t most_bytes);
  /// Replays the next record, whenever it is; false at the end.
  bool Step();
  /// The time of the next record; empty at the end.
  std::optional<uint64_t> next_ns() const;

  /// The moment that is shown.
  uint64_t time_ns() const { return time_ns_; }
  /// Whether the initial state has been read.
  bool has_views() const { return replay_ != nullptr && replay_->engine() != nullptr; }
  /// Increases when the engine is another one: what was compared with it is to be forgotten.
  uint64_t generation() const { return generation_; }
  const engine::Engine& engine() const { return *replay_->engine(); }

  /// Views of the moment `at_ns`, which is between the last record and the next one; as of a
  /// running server. Only if has_views().
  uint64_t FieldTimeAt(uint64_t at_ns) const;
  control::FieldView Field(uint64_t at_ns) const;
  std::vector<control::ClientView> Clients(uint64_t at_ns) const;
  std::vector<control::TagView> Tags(uint64_t at_ns) const;
  std::vector<control::NetView> Nets(uint64_t at_ns) const;
  std::vector<control::LinkView> Links(uint64_t at_ns) const;
  control::StatusView ServerStatus(uint64_t at_ns) const;
  const capture::Start& start() const { return replay_->start(); }

 private:
  // A moment at which the field's time is known.
  struct Anchor {
    uint64_t utc_ns = 0;
    uint64_t field_ms = 0;
  };
  struct LinkBytes {
    uint64_t received = 0;
    uint64_t sent = 0;
    uint64_t second = 0;       // the present one
    uint64_t in_second = 0;    // bytes in it
    uint64_t last_second = 0;  // and in the one before
  };
  // All that replaying a record changes, but for the replay itself.
  struct Progress {
    capture::CaptureReader::Position position;  // before the next record
    uint64_t last_ns = 0;                       // the latest time of a record
    Anchor anchor;
    engine::Traffic traffic;
    std::vector<LinkBytes> links;
  };
  struct Checkpoint {
    std::unique_ptr<const capture::Replay> replay;
    Progress progress;
  };

  void Restart();
  void GoOnFrom(const Checkpoint& checkpoint);
  bool Reopen(const capture::CaptureReader::Position& from);
  void ReadNext();
  void Note(const capture::Record& record);
  void NoteBatch(const capture::Batch& batch);
  void NoteEvent(const capture::EventApplied& applied);
  void Count(const capture::Packet& packet);
  void KeepCheckpoint();

  const std::string name_;
  const Open open_;
  const PlayerOptions options_;
  std::optional<capture::CaptureReader> surveyor_;
  bool is_surveyed_ = false;
  Range range_;
  uint64_t records_ = 0;  // of the range
  bool has_end_ = false;  // the last of them says so
  std::optional<Anchor> first_stamp_;
  std::string problem_;         // of the file
  std::string replay_problem_;  // of what was replayed
  std::optional<capture::CaptureReader> reader_;
  std::optional<capture::Found> next_;
  std::unique_ptr<capture::Replay> replay_;
  // Given for the present record; shared, since replays add to it.
  std::shared_ptr<std::vector<protocol::ErrorAnswer>> errors_ =
      std::make_shared<std::vector<protocol::ErrorAnswer>>();
  Progress progress_;
  uint64_t time_ns_ = 0;
  uint64_t target_ns_ = 0;
  uint64_t generation_ = 0;
  std::map<size_t, Checkpoint> checkpoints_;  // by their part of the range
};

}  // namespace pheromone::playback
