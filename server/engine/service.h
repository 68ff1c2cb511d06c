// The engine behind its lock, with its log and its clock: what links talk to. Entered once per
// batch of decoded frames; inside, every frame meets the same stamp and a total order.
//
//   service.Handle(link, messages, &out, askers);   // then send each of `out` on its link
//
// Thread-safe: all functions may be called from any thread. `out` may name other links than the one
// the batch came from.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "server/base/result.h"
#include "server/engine/engine.h"
#include "server/engine/field_clock.h"
#include "server/engine/frozen_state.h"
#include "server/engine/held_answers.h"
#include "server/engine/ordered_log.h"
#include "server/engine/traffic.h"
#include "server/engine/witness.h"

namespace pheromone::engine {

constexpr size_t kReasons = 21;

/// What was asked and answered, over all links, since the start.
struct ServiceCounters {
  uint64_t requests = 0;                    ///< messages handed in
  uint64_t ignored = 0;                     ///< of them: never answered
  uint64_t answers = 0;                     ///< other than errors
  uint64_t repeats = 0;                     ///< of the answers: given again, to a repeated request
  uint64_t changes = 0;                     ///< events that went through the log
  uint64_t observations = 0;                ///< poses that trackers reported and that were taken
  uint64_t observations_refused = 0;        ///< the robot is unknown, or the log took no changes
  std::array<uint64_t, kReasons> errors{};  ///< ERROR answers by reason
};

class Service {
 public:
  using ReadClock = std::function<ClockReading()>;

  /// `log` outlives the service. `read_clock` is called under the lock. After a restart, `start_ms`
  /// is the field time to go on with (FieldClock::ResumeAt) and `engine` the state to go on from.
  Service(OrderedLog* log, ReadClock read_clock, uint64_t start_ms = 0, Engine engine = {});

  /// `wake` is called when something becomes due earlier than MillisecondsToDeadline said last: a
  /// timer that waits should ask again. Under the lock, from any thread: post, and do not call
  /// back. To be set before anything else is called.
  void OnEarlierDeadline(std::function<void()> wake) { wake_ = std::move(wake); }

  /// What is done between two portions of a large change, without the lock: gives others their
  /// turn, and sends what the last portion gave, commands that are due. To be set before anything
  /// else is called; without it, portions follow each other at once.
  using BetweenPortions = std::function<void(std::span<const Outgoing>)>;
  void OnPortion(BetweenPortions between) { between_portions_ = std::move(between); }

  /// Logs and applies a configuration if it differs from the present one. Must succeed once before
  /// anything else is called. Errors: what the running state cannot follow. `state_lost`: changes
  /// that clients were told of are missing from the state; then it is logged in any case, and an
  /// epoch begins.
  ///
  /// Takes the caller as long as it takes, but holds up nobody else: it is compared and prepared
  /// without the lock, and applied in portions. Returns when what it lays and erases is done. One
  /// caller at a time.
  struct Configured {
    /// False: the log stopped taking changes on the way, and what is left is laid when it takes
    /// them again.
    bool all_laid = true;
  };
  Result<Configured> Configure(SharedConfig config, uint16_t new_epoch, bool state_lost = false);

  /// Handles the messages read at once from a link. `askers`: of all of them, one that is theirs,
  /// or none; their answers carry it.
  void Handle(LinkIndex link, std::span<const protocol::Message> messages,
              std::vector<Outgoing>* out, std::span<const Asker> askers = {});

  /// Logs and applies a command to a robot. Errors: no such robot, the log takes no changes, or
  /// kMostHeldCommands wait to become durable.
  Status Issue(const CommandIssued& command, std::vector<Outgoing>* out);

  /// What became of a change that an operator asked for.
  struct Applied {
    uint64_t sequence = 0;  ///< in the log, of the last event that it took
    int64_t nodes = 0;      ///< of the map, in the edit's shape
  };
  /// Logs and applies a change of the map by hand; in portions, as Configure does. Errors: what
  /// cannot be done, or the log takes no changes; then the map is as it was, but for a log that
  /// stops taking them on the way: then the rest follows when it does again.
  Result<Applied> Edit(const field::FieldEdit& edit);

  /// Takes what a tracker saw at once; returns how many were taken. Robots that have not said HELLO
  /// in this epoch are left out, and counted.
  size_t Observe(std::span<const PoseObserved> observations);

  /// The place of a link in the present configuration.
  std::optional<LinkIndex> FindLink(std::string_view name) const;

  /// Does what is due, in one bounded step. Call it when MillisecondsToDeadline() have passed; that
  /// says 0 if there is more, and nothing if no time will bring anything. While the log takes no
  /// changes nothing is done, and the deadline is put off by kPutOffMs.
  void AdvanceIfDue(std::vector<Outgoing>* out);
  std::optional<uint64_t> MillisecondsToDeadline();
  static constexpr uint64_t kPutOffMs = 1000;

  /// Appends what was waiting for its change to become durable and no longer is, in the order in
  /// which it was given: for each robot the answer to its latest request and to no other, for the
  /// one who asked for it last; and commands. In time proportional to their number.
  void Release(std::vector<Outgoing>* out);
  static constexpr size_t kMostHeldCommands = 1024;
  /// How many answers wait: at most one for each robot.
  size_t held_answers() const;

  /// Has `witness` told of everything from now on; null: nobody. It outlives the service, or its
  /// place there. `look(const Engine&)` sees the state that its knowledge begins with, or ends
  /// with.
  template <typename Look>
  void Attach(Witness* witness, Look&& look) {
    const std::lock_guard lock(mutex_);
    witness_ = witness;
    look(static_cast<const Engine&>(engine_));
  }

  /// Lets go of a frozen state under the lock. Not to be done inside of `look`.
  struct Thaw {
    Service* service = nullptr;
    void operator()(FrozenState* frozen) const;
  };
  using Frozen = std::unique_ptr<FrozenState, Thaw>;

  /// The state as it is now, to be copied in portions between which everybody else has his turn;
  /// null while another one is copied. Does not outlive the service. Not before it is configured.
  Frozen Freeze(uint64_t most_kept_bytes = FrozenState::kMostKeptBytes) {
    const std::lock_guard lock(mutex_);
    return FreezeInside(engine_, most_kept_bytes);
  }
  /// The same inside of `look`, which is given the engine.
  Frozen FreezeInside(const Engine& engine,
                      uint64_t most_kept_bytes = FrozenState::kMostKeptBytes) {
    return Frozen(engine.Freeze(most_kept_bytes).release(), Thaw{this});
  }
  /// As FrozenState::CopySome, under the lock where that is needed. One thread for each state.
  bool CopySome(FrozenState* frozen, std::string* to);

  /// Gives back a bounded portion of the memory of what was erased (Field::ReleaseMemory): to be
  /// called now and then. True if there is more. No event, and nothing that a client could see.
  bool ReleaseMemory() {
    const std::lock_guard lock(mutex_);
    return engine_.ReleaseMemory();
  }

  ServiceCounters counters() const;
  uint64_t StateHash() const;

  /// Calls `look(const Engine&)` under the lock: for status and tests. Keep it short.
  template <typename Look>
  auto Inspect(Look&& look) const {
    const std::lock_guard lock(mutex_);
    return look(engine_);
  }

  /// The same with what was heard of the robots: `look(const Engine&, const Traffic&)`.
  template <typename Look>
  auto InspectTraffic(Look&& look) const {
    const std::lock_guard lock(mutex_);
    return look(engine_, traffic_);
  }

 private:
  Witness::Outcome HandleOne(const Stamp& stamp, LinkIndex link, const protocol::Message& message,
                             std::vector<Outgoing>* out);
  protocol::Reason Change(const Stamp& stamp, const Event& event, std::vector<Outgoing>* out);
  static Status Prepare(const SharedConfig& present, const EngineConfig& next,
                        const field::Field& field, uint64_t now_ms, Event* event);
  Result<uint64_t> Finish(uint64_t id);
  protocol::Reason RefusalOfRepeat(const Outgoing& answer);
  void Drop(const std::optional<HeldAnswers::Dropped>& dropped);
  void HoldBack(std::vector<Outgoing>* out, size_t from);
  uint64_t AppendAndApply(const Stamp& stamp, const Event& event,
                          std::vector<Outgoing>* out) noexcept;
  Stamp StampNow();
  void WakeIfEarlier();

  mutable std::mutex mutex_;
  OrderedLog* log_;
  ReadClock read_clock_;
  FieldClock clock_;
  Engine engine_;
  std::function<void()> wake_;
  BetweenPortions between_portions_;
  std::map<uint64_t, std::optional<Status>> awaited_works_;  // by their sequence
  Witness* witness_ = nullptr;
  uint64_t awaited_ms_ = UINT64_MAX;  // the deadline that was told last, in field time
  uint64_t put_off_ms_ = 0;           // the log refused an Advance: not before this
  HeldAnswers held_;
  ServiceCounters counters_;
  Traffic traffic_;
};

}  // namespace pheromone::engine
