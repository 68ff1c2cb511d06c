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
// The state is that of its four parts (part.h): robots, field, nets and tags. The engine passes
// each request to the part of its opcode (routes.h), each event to that of its type, configurations
// and time to all of them in that order (nets read what robots have left on tags before the tags
// end leases), and sums their hashes. A copy continues as the original does.
//
// Not thread-safe: Service puts one lock around it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "protocol/messages.h"
#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/core/engine/event.h"
#include "server/core/engine/field_part.h"
#include "server/core/engine/nets_part.h"
#include "server/core/engine/refusal.h"
#include "server/core/engine/robots_part.h"
#include "server/core/engine/routes.h"
#include "server/core/engine/tags_part.h"
#include "server/core/field/field.h"

namespace pheromone::engine {

class FrozenState;

class Engine {
 public:
  /// Whether a ConfigChanged has been applied; nothing else may come before it.
  bool configured() const { return is_configured_; }
  const EngineConfig& config() const { return *config_; }
  const SharedConfig& shared_config() const { return config_; }
  const field::Field& field() const { return field_.field(); }
  const RobotTable& robots() const { return robots_.table(); }
  const RobotCounters& counters() const { return robots_.counters(); }
  const RevokedKeys& revoked_keys() const { return robots_.revoked_keys(); }
  const NetsPart& nets() const { return nets_; }
  const tags::Store& tags() const { return tags_.store(); }
  uint16_t epoch() const { return epoch_; }
  uint64_t sequence() const { return sequence_; }  ///< of the last event that was applied
  uint64_t field_time_ms() const { return field_time_ms_; }
  /// Of the last event that was applied; after Restore, without UTC. Not part of the state.
  const Stamp& last_stamp() const { return last_stamp_; }

  Handling Classify(LinkIndex link, const protocol::Message& message) const;
  /// Whether client messages with that opcode go through the log, one at a time for each robot.
  bool GoesThroughLog(uint8_t opcode) const {
    const Route::Effect effect = RouteOf(opcode & 0x7Fu).effect;
    return effect == Route::Effect::kChanges || effect == Route::Effect::kHello;
  }

  /// Answers a message of Handling::kAnswer: at most one message is appended to `out`.
  void Answer(const Stamp& stamp, LinkIndex link, const protocol::Message& message,
              std::vector<Outgoing>* out) const;

  /// Applies an event; appends to `messages` what is to be sent because of it. The first event has
  /// `sequence` 1. A RequestReceived must be of Handling::kChange; the others, but for Advance,
  /// must have been accepted by the checks below.
  void Apply(uint64_t sequence, const Stamp& stamp, const Event& event,
             std::vector<Outgoing>* messages);

  /// Whether an event from elsewhere, such as a file, may be applied now: it meets Apply's
  /// preconditions. Values inside a configuration are not checked (config_check.h).
  Status Check(const Event& event) const;

  /// Computes in advance what takes time proportional to an event's size: the raster of an edit,
  /// the plan of a new configuration. A prepared event is checked and applied in bounded time.
  /// Depends on its arguments only, so any thread may call it with a copy of the configuration.
  /// Errors: an edit of too many nodes.
  static Status Prepare(const SharedConfig& present, Event* event);
  /// The same for changes of the tags, which depend on what was written on them: `survey` is what
  /// Look gave for this event a moment ago. If that has changed, the event is applied nonetheless,
  /// in time that grows with the number of tags. Errors also: those of tags::MakePlan.
  static Status Prepare(const SharedConfig& present, const tags::Survey& survey, Event* event);
  tags::Survey Look() const { return tags().Look(); }
  /// With the present configuration; does nothing before the first one.
  Status Prepare(Event* event) const { return configured() ? Prepare(config_, event) : Ok(); }

  /// `plan` may be null. Without one, and if pheromones are removed, in time that grows with the
  /// map's contents.
  Status CheckConfig(const EngineConfig& next, const ConfigPlan* plan = nullptr) const;
  /// Checks an edit, except its size: unknown type, blend, level, shape, too many in progress.
  Status CheckEdit(const field::FieldEdit& edit) const { return field_.CheckEdit(edit); }
  /// The edits, undoings and configurations that the last Apply completed, by the sequence numbers
  /// of their events. Whether there is memory for all of an edit shows only when it is made; if
  /// not, nothing was changed. Not part of the state.
  const std::vector<field::FinishedWork>& finished() const { return finished_; }
  /// What the last Apply did, in nodes of the map that an edit sets in that time: exact, and the
  /// same in each replay. Not part of the state.
  uint64_t cost() const { return cost_; }
  /// For a state that was put together from edits: none of them can be undone, or is told as
  /// forgotten. Not an event.
  void ForgetEdits() { field_.ForgetEdits(); }
  /// The same: it continues the tags and nets of `from`, with all that is written on them, under
  /// its own configuration. Errors, which change nothing: those of CheckConfig.
  Status ContinueTagsAndNets(const Engine& from);
  /// Whether one of them is still changing the map: Advance continues it.
  bool is_busy() const { return field_.busy(); }

  /// The event to be applied next if the robot that sent this SENSE or TRACE is at its goal. The
  /// position is the present one, whether it is the robot's own or a tracker's.
  std::optional<GoalEnded> Arrival(const Stamp& stamp, LinkIndex link,
                                   const protocol::Message& message) const;

  /// Whether a robot has said HELLO in this epoch: only then may a PoseObserved name it.
  bool SaidHello(LinkIndex link, uint8_t id) const { return robots().SaidHello(link, id, epoch_); }

  /// The field time at which an Advance is due; empty if never. After an Advance it may still be in
  /// the past: then more is due than one step does.
  std::optional<uint64_t> NextDeadline() const;

  /// The sum over all live objects of the hash of kind, key and canonical value. Equal states have
  /// equal hashes, whatever way they came about.
  uint64_t StateHash() const;

  /// As RobotTable::ForgetAsMutant.
  void ForgetAsMutant(LinkIndex link, uint8_t id) { robots_.ForgetAsMutant(link, id); }

  /// As in Field: releases a bounded portion of erased memory; the state does not change.
  bool ReleaseMemory() { return field_.ReleaseMemory(); }

  /// The whole state as bytes. A restored engine behaves as the saved one would have: the same
  /// answers and the same hashes to any input. Only once configured.
  void Save(ByteWriter* writer) const;
  /// The same for the present state, to be copied in portions (frozen_state.h). Null while another
  /// one is being copied.
  std::unique_ptr<FrozenState> Freeze(uint64_t most_kept_bytes) const;
  /// Errors: another version; bytes that no engine can have saved.
  static Result<Engine> Restore(ByteReader* reader);

 private:
  // In the order of application.
  template <typename Self, typename Visit>
  static void ForEachPart(Self& self, Visit&& visit) {
    visit(self.robots_);
    visit(self.field_);
    visit(self.nets_);
    visit(self.tags_);
  }

  Context Now(const SharedConfig& config) const {
    return {config, robots(), tags(), epoch_, sequence_, field_time_ms_, last_stamp_.utc_ms};
  }
  Context Now() const { return Now(config_); }
  static constexpr uint64_t kCostOfEvent = 64;  // of reading it, and of all but the map
  static protocol::Reason FaultOf(const protocol::Message& message);

  void On(const RequestReceived& request, const Output& out);
  void On(const ConfigChanged& change, const Output& out);

  void TakeConfig(SharedConfig config, const ConfigFigures& figures);
  void SaveBeforeParts(ByteWriter* writer) const;

  RobotsPart robots_;
  FieldPart field_;
  NetsPart nets_;
  TagsPart tags_;
  SharedConfig config_;
  ConfigFigures config_figures_;
  bool is_configured_ = false;
  uint16_t epoch_ = 0;
  uint64_t field_time_ms_ = 0;
  uint64_t sequence_ = 0;
  std::vector<field::FinishedWork> finished_;
  uint64_t cost_ = 0;
  Stamp last_stamp_;
};

}  // namespace pheromone::engine
