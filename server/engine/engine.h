// The engine: request in, answer out, and the only place where state changes. A deterministic state
// machine without clock, thread, socket or log: the same events with the same stamps give the same
// answers and the same state hash, live, in a simulation and in a replay.
//
//   Engine engine;
//   engine.Apply(1, stamp, ConfigChanged{config, epoch}, &out);
//   switch (engine.Classify(link, message)) {
//     case Handling::kIgnore: break;
//     case Handling::kAnswer: engine.Answer(stamp, link, message, &out); break;      // no change
//     case Handling::kChange: engine.Apply(sequence, stamp, RequestReceived{...}, &out); break;
//   }
//
// Not thread-safe: Service puts one lock around it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/engine/event.h"
#include "server/engine/robot_table.h"
#include "server/field/field.h"

namespace pheromone::engine {

/// What a message from a client asks for.
enum class Handling {
  kIgnore,  ///< never answered: an echo, an ID that is nobody's, an old duplicate
  kAnswer,  ///< answered from the present state, which stays as it is
  kChange,  ///< must go through the log
};

/// What happened so far that an operator may want to know of. Not part of the state.
struct EngineCounters {
  uint64_t id_conflicts = 0;      ///< two nonces taking turns under one ID
  uint64_t robots_forgotten = 0;  ///< to make room for another
  uint64_t commands_unanswered = 0;
  uint64_t commands_unknown = 0;  ///< the robot restarted before it acknowledged
};

/// The ERROR that refuses `message`; with its seq, if it has one.
protocol::Message ErrorMessage(const protocol::Message& message, protocol::Reason reason);

class FrozenState;

class Engine {
 public:
  /// The intervals between a command's transmissions double from the first to the longest; after
  /// the last one the command is reported unanswered.
  static constexpr uint64_t kFirstRetryMs = 250;
  static constexpr uint64_t kLongestRetryMs = 4000;
  static constexpr uint8_t kCommandTransmissions = 6;
  /// A broadcast halt is sent this often, this far apart. A resume waits until it has been.
  static constexpr uint8_t kBroadcastTransmissions = 3;
  static constexpr uint64_t kBroadcastIntervalMs = 100;

  /// Whether a ConfigChanged has been applied; nothing else may come before it.
  bool configured() const { return field_ != nullptr; }
  const EngineConfig& config() const { return *config_; }
  const SharedConfig& shared_config() const { return config_; }
  const field::Field& field() const { return *field_; }
  const RobotTable& robots() const { return robots_; }
  const EngineCounters& counters() const { return counters_; }
  uint16_t epoch() const { return epoch_; }
  uint64_t sequence() const { return sequence_; }  ///< of the last event that was applied
  uint64_t field_time_ms() const { return field_time_ms_; }
  /// Of the last event that was applied; after Restore, without UTC. Not part of the state.
  const Stamp& last_stamp() const { return last_stamp_; }

  Handling Classify(LinkIndex link, const protocol::Message& message) const;

  /// Answers a message of Handling::kAnswer: at most one message is appended to `out`.
  void Answer(const Stamp& stamp, LinkIndex link, const protocol::Message& message,
              std::vector<Outgoing>* out) const;

  /// Applies an event; appends what is to be sent because of it. `sequence` numbers the events from
  /// 1. A RequestReceived must be of Handling::kChange; the others, but for Advance, must have been
  /// accepted by the checks below.
  void Apply(uint64_t sequence, const Stamp& stamp, const Event& event, std::vector<Outgoing>* out);

  /// Whether an event that comes from elsewhere, such as a file, may be applied now: it meets what
  /// Apply asks for. Values inside a configuration are not looked at (config_check.h).
  Status Check(const Event& event) const;

  /// Works out beforehand what an event needs that takes time with its size: the raster of an edit,
  /// the plan of a new configuration. An event that has it is checked and applied in bounded time.
  /// Pure but for the present configuration, so any thread may do the same with a copy of that.
  /// Errors: an edit of too many nodes.
  static Status Prepare(const SharedConfig& present, Event* event);
  /// With the present configuration; does nothing before the first one.
  Status Prepare(Event* event) const { return configured() ? Prepare(config_, event) : Ok(); }

  /// `plan` may be null. Without one, and for pheromones that go, in time that grows with what lies
  /// on the map.
  Status CheckConfig(const EngineConfig& next, const ConfigPlan* plan = nullptr) const;
  Status CheckCommand(const CommandIssued& command) const;

  /// Says all that is clear before the edit is made, but for its size: unknown type, blend, level,
  /// shape, too many under way.
  Status CheckEdit(const field::FieldEdit& edit) const;
  /// The edits and configurations that came to their end with the last Apply, by the sequence
  /// numbers of their events: whether there was memory for all of an edit shows only when it is
  /// made. If not, nothing was changed. Not part of the state.
  const std::vector<field::FinishedWork>& finished() const { return finished_; }
  /// Whether the map is still being changed by one of them: Advance goes on with it.
  bool is_busy() const { return configured() && field_->busy(); }

  /// Whether a robot has said HELLO in this epoch: only then may a PoseObserved name it.
  bool SaidHello(LinkIndex link, uint8_t id) const;

  /// Where on the map a robot is that reports `reported`: where a tracker saw it lately, else where
  /// it says, from its own frame into the map's.
  field::PoseUm PoseOf(LinkIndex link, uint8_t id, const protocol::WirePose& reported,
                       uint64_t now_ms) const;

  /// The field time at which an Advance has something to do, nothing if never. After an Advance it
  /// may still lie in the past: then there is more to do than fits into one step.
  std::optional<uint64_t> NextDeadline() const;

  /// The sum over all live objects of the hash of kind, key and canonical value. Equal states have
  /// equal hashes, whatever way they came about.
  uint64_t StateHash() const;

  /// As of Field: gives back memory that was erased, in a bounded portion, and changes nothing.
  bool ReleaseMemory() { return configured() && field_->ReleaseMemory(); }

  /// All of the state, as bytes. A restored engine goes on as the saved one would have: the same
  /// answers and the same hashes, to whatever comes. To be called once configured.
  void Save(ByteWriter* writer) const;
  /// The same, as the state is now, to be copied in portions (frozen_state.h). At most one at a
  /// time; while there is one, null.
  std::unique_ptr<FrozenState> Freeze(uint64_t most_kept_bytes) const;
  /// Errors: bytes of another version, or such that no engine can have saved.
  static Result<Engine> Restore(ByteReader* reader);

 private:
  struct Broadcast {
    LinkIndex link;
    uint8_t seq;
    uint8_t left;
    uint64_t next_ms;
  };

  void On(const RequestReceived& request, std::vector<Outgoing>* out);
  void On(const Advance& advance, std::vector<Outgoing>* out);
  void On(const ConfigChanged& change, std::vector<Outgoing>* out);
  void On(const CommandIssued& issued, std::vector<Outgoing>* out);
  void On(const FieldEdited& edited, std::vector<Outgoing>* out);
  void On(const PoseObserved& observed, std::vector<Outgoing>* out);

  void TakeConfig(SharedConfig config, const ConfigFigures& figures);
  void SaveAfterConfig(ByteWriter* writer) const;
  protocol::Message TakeHello(LinkIndex link, const protocol::HelloRequest& hello);
  protocol::Message TakeChange(LinkIndex link, const protocol::Message& request);
  protocol::Message TakeDeposit(LinkIndex link, const protocol::Message& message);
  protocol::Message TakeTrace(LinkIndex link, const protocol::Message& message);
  void TakeCommandAck(LinkIndex link, const protocol::CommandAck& ack);
  protocol::Message AnswerSense(LinkIndex link, const protocol::Message& message,
                                uint64_t now_ms) const;
  void Send(LinkIndex link, const protocol::Message& message, std::vector<Outgoing>* out) const;
  void SendCommand(LinkIndex link, uint8_t id, RobotState* robot, std::vector<Outgoing>* out);
  void GiveUp(CommandState* command);
  void DropPendingResumes(LinkIndex link);
  void SendBroadcast(Broadcast* broadcast, std::vector<Outgoing>* out);

  SharedConfig config_;
  ConfigFigures config_figures_;
  std::map<std::pair<LinkIndex, uint8_t>, RobotFrame> frames_;  // of the present links
  std::unique_ptr<field::Field> field_;
  RobotTable robots_;
  std::vector<Broadcast> broadcasts_;
  uint8_t next_broadcast_seq_ = 0;
  uint16_t epoch_ = 0;
  uint64_t field_time_ms_ = 0;
  uint64_t sequence_ = 0;
  EngineCounters counters_;
  std::vector<field::FinishedWork> finished_;
  Stamp last_stamp_;
};

}  // namespace pheromone::engine
