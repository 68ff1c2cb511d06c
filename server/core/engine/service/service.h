// The engine behind its lock, with its log and its clock; the interface for links. Entered once per
// batch of decoded frames, all of which get the same stamp and a total order.
//
//   service.Handle(link, messages, &out, askers);   // then send each of `out` on its link
//
// Thread-safe: all functions may be called from any thread. `out` may name other links than the one
// the batch came from.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
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
#include "server/core/engine/engine.h"
#include "server/core/engine/frozen_state.h"
#include "server/core/engine/service/field_clock.h"
#include "server/core/engine/service/held_answers.h"
#include "server/core/engine/service/observer.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/traffic.h"

namespace pheromone::engine {

constexpr size_t kReasons = 21;

/// Requests and answers on all links since the start.
struct ServiceCounters {
  uint64_t requests = 0;                    ///< messages handed in
  uint64_t ignored = 0;                     ///< of them: never answered
  uint64_t answers = 0;                     ///< other than errors
  uint64_t repeats = 0;                     ///< of the answers: to repeated requests
  uint64_t changes = 0;                     ///< events that went through the log
  uint64_t forwarded = 0;                   ///< changes passed on to the server that orders them
  uint64_t observations = 0;                ///< accepted poses from trackers
  uint64_t observations_refused = 0;        ///< the robot is unknown, or the log refused changes
  std::array<uint64_t, kReasons> errors{};  ///< ERROR answers by reason
};

class Service {
 public:
  using ReadClock = std::function<ClockReading()>;

  /// `log` outlives the service. `read_clock` is called under the lock. After a restart, `start_ms`
  /// is the field time to resume with (FieldClock::ResumeAt) and `engine` the state to resume from.
  Service(OrderedLog* log, ReadClock read_clock, uint64_t start_ms = 0, Engine engine = {});

  /// `wake` is called when something becomes due earlier than MillisecondsToDeadline said last: a
  /// timer that waits should ask again. Under the lock, from any thread: post, and do not call
  /// back. To be set before anything else is called.
  void OnEarlierDeadline(std::function<void()> wake) { wake_ = std::move(wake); }

  /// Called after each portion of a change of the map, without the lock, to let other threads run
  /// and to send the messages of the last portion, such as due commands. To be set before anything
  /// else is called; without it, portions follow each other at once.
  using BetweenPortions = std::function<void(std::span<const Outgoing>)>;
  void OnPortion(BetweenPortions between) { between_portions_ = std::move(between); }

  /// Logs and applies a configuration if it differs from the present one. Must succeed once before
  /// anything else is called. Errors: the change is incompatible with the running state.
  /// `state_lost`: acknowledged changes are missing from the state; then the configuration is
  /// logged in any case, and a new epoch begins.
  ///
  /// May take long, but blocks only the caller: it is compared and prepared without the lock, and
  /// applied in portions. Returns when everything is deposited and erased. One caller at a time.
  struct Configured {
    /// False: the log stopped accepting changes on the way, and the rest follows when it accepts
    /// them again.
    bool all_laid = true;
  };
  Result<Configured> Configure(SharedConfig config, uint16_t new_epoch, bool state_lost = false);

  /// Where several servers share one log (server/cluster), another one may order the changes. Then
  /// `forward` passes on a robot's change, or an arrival, and returns true: here nothing changes
  /// and nothing is answered yet. Under the lock, from any thread: post, and do not call back. To
  /// be set before anything else is called.
  using Forward = std::function<bool(const Event&)>;
  void OnChange(Forward forward) { forward_ = std::move(forward); }

  /// Applies the next event of the shared log, as another server has ordered it. The answer to a
  /// request is sent from here if it was forwarded from here; commands if their robot was heard
  /// here. Errors: the event is not possible, so this state is not the other's.
  Status Follow(const Stamp& stamp, Event event, std::vector<Outgoing>* out);

  /// Called when keys were revoked, here or by another server. Under the lock, from any thread:
  /// post, and do not call back. To be set before anything else is called.
  void OnRevoked(std::function<void()> revoked) { revoked_ = std::move(revoked); }

  /// Called when a configuration was followed. Under the lock, from the thread that follows: post,
  /// and do not call back. To be set before anything else is called.
  void OnConfigured(std::function<void()> configured) { configured_ = std::move(configured); }

  /// Appends the answer that was given elsewhere to a forwarded request, a refusal for instance, if
  /// the robot still waits for it here.
  void AnswerForwarded(LinkIndex link, const protocol::Message& message,
                       std::vector<Outgoing>* out);

  /// The robots that were heard here after `since_ms`, and those that another server has heard: for
  /// what depends on the last pose of a robot, whoever heard it.
  std::vector<HeardPose> PosesSince(uint64_t since_ms) const;
  void NotePoses(std::span<const HeardPose> poses);

  /// Field time goes on from here at the earliest: after all servers were down.
  void ResumeAt(uint64_t field_time_ms) {
    const std::lock_guard lock(mutex_);
    clock_.Follow({std::max(field_time_ms, clock_.Read(read_clock_()).field_time_ms), 0},
                  read_clock_());
  }

  /// Called when a robot was seen at its goal. Under the lock, from any thread: post, and do not
  /// call back. To be set before anything else is called.
  using Arrived = std::function<void(const GoalEnded&)>;
  void OnArrival(Arrived arrived) { arrived_ = std::move(arrived); }

  /// Handles the messages of one read from a link. `askers`: one for each message, one for all, or
  /// none; the answers carry the asker of their request.
  void Handle(LinkIndex link, std::span<const protocol::Message> messages,
              std::vector<Outgoing>* out, std::span<const Asker> askers = {});

  /// Logs and applies a command to a robot. Errors: no such robot, the log does not accept changes,
  /// or kMaxHeldCommands wait to become durable.
  Status Issue(const CommandIssued& command, std::vector<Outgoing>* out);

  /// The outcome of an operator's change.
  struct Applied {
    uint64_t sequence = 0;  ///< in the log, of the last event that it took
    int64_t nodes = 0;      ///< of the map, in the edit's shape
    uint64_t changed = 0;   ///< of them: their level is another one now
    uint64_t edit = 0;      ///< its ID in the history; 0: there is nothing to undo
  };
  /// Sends a robot to a point of the map, along a route around the obstacles from where it was last
  /// seen, which is searched for without the lock. The robot is led there from its next request on;
  /// at the goal it is halted. Errors: the robot has not said HELLO or not reported a pose, those
  /// of field::FindRoute and CheckGoal, the log does not accept changes.
  Status SetGoal(LinkIndex link, uint8_t id, field::PointUm point, uint32_t tolerance_um);
  /// Returns a robot to the field. Errors: it has no goal, the log does not accept changes.
  Status CancelGoal(LinkIndex link, uint8_t id);

  /// Logs and applies a change of the map by hand; in portions, as Configure does. Errors: the edit
  /// is impossible, or the log does not accept changes; then the map is unchanged, unless the log
  /// stopped during the edit: then the rest follows when it accepts them again.
  Result<Applied> Edit(const field::FieldEdit& edit);

  /// Undoes the last edit that is not yet undone, or redoes the one that was undone last: logged
  /// and applied as above (server/core/field/edit_history.h). Errors: there is none; those of Edit.
  struct Reversed {
    field::EditInfo edit;
    std::string pheromone;  ///< its name
    uint64_t changed = 0;   ///< nodes whose level is another one now
  };
  Result<Reversed> Reverse(bool redo);

  /// Logs and applies an operator's change of tags or nets; returns its sequence number in the log.
  /// Errors: it is refused, or the log does not accept changes.
  Result<uint64_t> Submit(const Event& event, std::vector<Outgoing>* out);

  /// Applies the poses of one tracker message; returns how many were accepted. Robots that have not
  /// sent HELLO in this epoch are skipped and counted.
  size_t Observe(std::span<const PoseObserved> observations);

  /// The index of a link in the present configuration.
  std::optional<LinkIndex> FindLink(std::string_view name) const;

  /// Performs due work in one bounded step. Call it after MillisecondsToDeadline(), which is 0 if
  /// there is more to do, and empty if nothing is scheduled. While the log does not accept changes,
  /// nothing is done and the deadline is postponed by kPutOffMs.
  void AdvanceIfDue(std::vector<Outgoing>* out);
  std::optional<uint64_t> MillisecondsToDeadline();
  static constexpr uint64_t kPutOffMs = 1000;

  /// Appends the held messages whose change has become durable, in the order in which they were
  /// given: for each robot only the answer to its latest request, for the last asker; and commands.
  /// In time proportional to their number.
  void Release(std::vector<Outgoing>* out);
  static constexpr size_t kMaxHeldCommands = 1024;
  /// The number of held answers: at most one for each robot.
  size_t held_answers() const;

  /// Notifies `observer` of everything from now on, after those that were attached before it; once,
  /// however often it is attached. It must outlive its attachment. `look(const Engine&)` is called
  /// with the state from which on it observes.
  template <typename Look>
  void Attach(Observer* observer, Look&& look) {
    assert(observer != nullptr);
    const std::lock_guard lock(mutex_);
    if (std::find(observers_.begin(), observers_.end(), observer) == observers_.end()) {
      observers_.push_back(observer);
    }
    look(static_cast<const Engine&>(engine_));
  }

  /// Ends its notifications, if it was attached. `look(const Engine&)` is called with the state up
  /// to which it observed.
  template <typename Look>
  void Detach(Observer* observer, Look&& look) {
    const std::lock_guard lock(mutex_);
    std::erase(observers_, observer);
    look(static_cast<const Engine&>(engine_));
  }
  void Detach(Observer* observer) {
    Detach(observer, [](const Engine&) {});
  }

  /// Releases a frozen state under the lock. Not to be called inside `look`.
  struct Thaw {
    Service* service = nullptr;
    void operator()(FrozenState* frozen) const;
  };
  using Frozen = std::unique_ptr<FrozenState, Thaw>;

  /// Freezes the present state, to be copied in portions between which other threads proceed;
  /// null while another one is copied. Does not outlive the service. Not before it is configured.
  Frozen Freeze(uint64_t most_kept_bytes = FrozenState::kMaxKeptBytes) {
    const std::lock_guard lock(mutex_);
    return FreezeInside(engine_, most_kept_bytes);
  }
  /// The same inside of `look`, which is given the engine.
  Frozen FreezeInside(const Engine& engine, uint64_t most_kept_bytes = FrozenState::kMaxKeptBytes) {
    return Frozen(engine.Freeze(most_kept_bytes).release(), Thaw{this});
  }
  /// As FrozenState::CopySome, under the lock where that is needed. One thread for each state.
  bool CopySome(FrozenState* frozen, std::string* to);

  /// Releases a bounded portion of erased memory (Field::ReleaseMemory); to be called periodically.
  /// True if there is more. Not an event, and not visible to clients.
  bool ReleaseMemory() {
    const std::lock_guard lock(mutex_);
    return engine_.ReleaseMemory();
  }

  /// The present field time. Under the lock: inside of `look`, or from a thread that it calls.
  uint64_t FieldTimeInside() { return StampNow().field_time_ms; }

  ServiceCounters counters() const;
  uint64_t StateHash() const;

  /// Calls `look(const Engine&)` under the lock: for status and tests. Keep it short.
  template <typename Look>
  auto Inspect(Look&& look) const {
    const std::lock_guard lock(mutex_);
    return look(engine_);
  }

  /// The same with the robots' traffic: `look(const Engine&, const Traffic&)`.
  template <typename Look>
  auto InspectTraffic(Look&& look) const {
    const std::lock_guard lock(mutex_);
    return look(engine_, traffic_);
  }

 private:
  std::optional<Observer::Outcome> HandleOne(const Stamp& stamp, LinkIndex link,
                                             const protocol::Message& message, const Asker& asker,
                                             std::vector<Outgoing>* out);
  protocol::Reason Change(const Stamp& stamp, const Event& event, std::vector<Outgoing>* out);
  uint64_t Order(const Stamp& stamp, const Event& event, std::vector<Outgoing>* out);
  bool IsForwarded(const RequestReceived& received, const Asker& asker);
  void AppendForwarded(Outgoing answer, std::vector<Outgoing>* out);
  Result<uint64_t> ChangeNow(const Event& event, std::vector<Outgoing>* out);
  Result<uint64_t> CheckAndChange(const Event& event, std::vector<Outgoing>* out);
  static Status Prepare(const SharedConfig& present, const EngineConfig& next,
                        const field::Field& field, const tags::Survey& survey, uint64_t now_ms,
                        Event* event);
  struct Finished {
    uint64_t sequence = 0;  ///< of the last event
    field::FinishedWork work;
  };
  Result<Finished> Finish(uint64_t id);
  protocol::Reason RefusalOfRepeat(const Outgoing& answer);
  void Drop(const std::optional<HeldAnswers::Dropped>& dropped);
  template <typename Tell>
  void TellObservers(Tell&& tell);
  void NotifyOfBatch(const Stamp& stamp, LinkIndex link,
                     std::span<const protocol::Message> messages,
                     std::span<const Observer::Outcome> outcomes, std::span<const Outgoing> sent);
  void HoldBack(std::vector<Outgoing>* out, size_t from);
  uint64_t AppendAndApply(const Stamp& stamp, const Event& event,
                          std::vector<Outgoing>* out) noexcept;
  void NoticeArrivals(const Stamp& stamp, LinkIndex link,
                      std::span<const protocol::Message> messages, std::vector<Outgoing>* out);
  Stamp StampNow();
  void WakeIfEarlier();

  mutable std::mutex mutex_;
  OrderedLog* log_;
  ReadClock read_clock_;
  FieldClock clock_;
  Engine engine_;
  std::function<void()> wake_;
  BetweenPortions between_portions_;
  Arrived arrived_;
  Forward forward_;
  std::function<void()> configured_;
  std::function<void()> revoked_;
  std::map<std::pair<LinkIndex, uint8_t>, Asker> forwarded_;  // of the robots' pending changes
  std::map<uint64_t, std::optional<field::FinishedWork>> awaited_works_;  // by their sequence
  std::vector<Observer*> observers_;  // few: in the order of attachment
  uint64_t awaited_ms_ = UINT64_MAX;  // the last reported deadline, in field time
  uint64_t put_off_ms_ = 0;           // the log refused an Advance: not before this
  HeldAnswers held_;
  ServiceCounters counters_;
  Traffic traffic_;
};

}  // namespace pheromone::engine
