// A composed net while it is executed, as a value: where its tokens are, how much pheromone the
// trails have, what the source has left, and what each tag tells the robots.
//
//   LiveNet net(rules);                                   // live_rules.h
//   std::vector<Firing> fired;
//   net.Take(at_N1, {.robot = 15, .seq = 3, .action = LiveAction::kPresent}, now_ms, &fired);
//   net.Settle(now_ms, &fired);                           // what the environment does
//   LiveSigns signs = net.SignsAt(at_N1);                 // to be written on the tag
//
// What a robot says fires one transition of its own, with at most one silent one before it, or
// nothing: an exception, of which the tag tells. Records are numbered by robot (seq): one with the
// number of its last one is answered again, as that was, and one with a number shortly before is
// out of date; neither fires anything.
//
// Each firing is one of the net that `pheromonectl net check` proves; conditions only restrict
// which of the enabled transitions fire. Pure; one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/fields.h"
#include "server/base/result.h"
#include "server/core/petri/live_rules.h"

namespace pheromone::petri {

struct Firing {
  uint32_t transition = 0;
  int32_t robot = 0;  ///< 0: the environment
  bool operator==(const Firing&) const = default;
};

/// What a robot says at a tag.
struct RobotSays {
  int32_t robot = 0;
  uint8_t seq = 0;
  LiveAction action = LiveAction::kPresent;
  uint16_t amount = 0;
};

/// Numbers as in protocol::NetOutcome.
enum class LiveOutcome : uint8_t { kNone = 0, kAccepted = 1, kRefused = 2 };

/// The answer to a robot.
struct LiveAck {
  int32_t robot = 0;  ///< 0: none
  uint8_t seq = 0;
  LiveOutcome outcome = LiveOutcome::kNone;
  uint16_t amount = 0;  ///< granted
  bool operator==(const LiveAck&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("robot", it.robot, AtLeast(0));
    visit("seq", it.seq);
    visit("outcome", it.outcome, UpTo(LiveOutcome::kRefused));
    visit("amount", it.amount);
  }
};

/// Why a robot's record fired nothing.
enum class Refusal : uint8_t {
  kNotEnabled,  ///< the net does not permit it now
  kNoTicket,    ///< another robot has presented itself there
  kVersion,     ///< of a record; and so on
  kCrc,
  kKind,
  kHash,
  kValue,
};
constexpr Refusal kLastRefusal = Refusal::kValue;
/// In words.
std::string_view TextOf(Refusal refusal);

/// An exception, for people.
struct LiveException {
  uint64_t at_ms = 0;
  uint8_t tag = 0;  ///< index
  int32_t robot = 0;
  uint8_t seq = 0;
  uint8_t action = 0;  ///< a LiveAction; 0: not readable
  Refusal why = Refusal::kNotEnabled;
  bool operator==(const LiveException&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("at_ms", it.at_ms);
    visit("tag", it.tag);
    visit("robot", it.robot, AtLeast(0));
    visit("seq", it.seq);
    visit("action", it.action, Within(0, static_cast<int64_t>(kLastLiveAction)));
    visit("why", it.why, UpTo(kLastRefusal));
  }
};

struct LiveCounts {
  uint64_t firings = 0;
  uint64_t records = 0;     ///< of robots, that were read
  uint64_t repeats = 0;     ///< of them: they had been answered before
  uint64_t exceptions = 0;  ///< of them: refused
  uint64_t deposits = 0;
  uint64_t deposited = 0;  ///< energy
  uint64_t taken = 0;      ///< energy
  uint64_t restored = 0;   ///< times that the reader's own blocks had to be written again
  uint64_t blocked = 0;    ///< times that they could not be written: the tag is full
  bool operator==(const LiveCounts&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("firings", it.firings);
    visit("records", it.records);
    visit("repeats", it.repeats);
    visit("exceptions", it.exceptions);
    visit("deposits", it.deposits);
    visit("deposited", it.deposited);
    visit("taken", it.taken);
    visit("restored", it.restored);
    visit("blocked", it.blocked);
  }
};

struct LiveTagState {
  LiveAck last;     ///< the answer to the last robot
  LiveAck waiting;  ///< to the one that has presented itself, and has not passed
  bool operator==(const LiveTagState&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("last", it.last);
    visit("waiting", it.waiting);
  }
};

/// What a tag shows.
struct LiveSigns {
  bool green = false;
  Advice advice = Advice::kAny;
  LiveAck ack;
  uint16_t left = 0;  ///< in the source, 65535 if it is more
  bool operator==(const LiveSigns&) const = default;
};

class LiveNet {
 public:
  /// Firings of the environment at one instant; a net that does more does not come to rest.
  static constexpr int kMaxFirings = 1'000;
  static constexpr size_t kKeptExceptions = 8;
  /// A seq that is at most so many less than a robot's last one is out of date.
  static constexpr uint8_t kOutOfDate = 8;

  /// In the initial marking.
  explicit LiveNet(std::shared_ptr<const LiveRules> rules);

  const LiveRules& rules() const { return *rules_; }
  std::shared_ptr<const LiveRules> shared_rules() const { return rules_; }
  const std::vector<int32_t>& marking() const { return state_.marking; }
  const Trails& trails() const { return state_.trails; }
  uint32_t source_left() const { return state_.source_left; }
  const LiveCounts& counts() const { return state_.counts; }
  const std::vector<LiveTagState>& tags() const { return state_.tags; }
  /// The answers to the last record of each robot, by its number.
  const std::vector<LiveAck>& robots() const { return state_.robots; }
  /// The last ones, the oldest first.
  const std::vector<LiveException>& exceptions() const { return state_.exceptions; }
  uint64_t last_firing_ms() const { return state_.last_firing_ms; }

  /// What the marking advises.
  Advice Advised() const;
  /// What it should advise.
  Advice Computed(uint64_t now_ms) const;

  /// Fires what a robot says at a tag; appends it to `fired`. The answer is SignsAt's from now on.
  LiveOutcome Take(size_t tag, const RobotSays& says, uint64_t now_ms, std::vector<Firing>* fired);
  /// A record that is not understood; the robot is told if its seq is known.
  void Refuse(const LiveException& what, bool has_seq);
  /// Fires what the environment does, until it comes to rest.
  void Settle(uint64_t now_ms, std::vector<Firing>* fired);

  LiveSigns SignsAt(size_t tag) const;
  /// The first instant after `now_ms` at which the advice has to change by itself.
  std::optional<uint64_t> NextChange(uint64_t now_ms) const;

  void CountRestored() { ++state_.counts.restored; }
  void CountBlocked() { ++state_.counts.blocked; }

  /// Goes on under other rules for the same net (LiveSettings::SameNet): what there is now is
  /// stored, and evaporates by them. Answers stay at tags of the same name.
  void Adopt(std::shared_ptr<const LiveRules> rules, uint64_t now_ms);

  uint64_t Hash() const;
  void Save(ByteWriter* writer) const;
  /// Into a new one of the same rules. Invalid bytes fail the reader.
  void Restore(ByteReader* reader);

 private:
  struct State {
    std::vector<int32_t> marking{};
    Trails trails{};
    uint16_t pending_a = 0;  // deposits that were not yet read
    uint16_t pending_b = 0;
    uint32_t source_left = 0;
    uint64_t last_firing_ms = 0;
    LiveCounts counts{};
    std::vector<LiveTagState> tags{};
    std::vector<LiveAck> robots{};  // by number
    std::vector<LiveException> exceptions{};

    template <typename Self, typename Visit>
    static void Fields(Self& it, Visit&& visit) {
      visit("marking", it.marking, Within(0, kMaxTokens));
      visit("a_milli", it.trails.a.stored_milli, Within(0, kMaxConcentrationMilli));
      visit("a_since_ms", it.trails.a.since_ms);
      visit("b_milli", it.trails.b.stored_milli, Within(0, kMaxConcentrationMilli));
      visit("b_since_ms", it.trails.b.since_ms);
      visit("pending_a", it.pending_a);
      visit("pending_b", it.pending_b);
      visit("source_left", it.source_left);
      visit("last_firing_ms", it.last_firing_ms);
      visit("counts", it.counts);
      visit("tags", it.tags);
      visit("robots", it.robots);
      visit("exceptions", it.exceptions);
    }
  };

  bool CanFire(uint32_t transition) const;
  void Fire(uint32_t transition, int32_t robot, uint64_t now_ms, std::vector<Firing>* fired);
  bool FireFor(size_t tag, const RobotSays& says, uint64_t now_ms, std::vector<Firing>* fired);
  uint16_t Carry(const RobotSays& says);
  bool Holds(const LiveRules::Environment& it, uint64_t now_ms) const;
  const LiveAck* FindRobot(int32_t robot) const;
  void Answer(size_t tag, const LiveAck& ack);
  Status CheckState() const;

  std::shared_ptr<const LiveRules> rules_;
  State state_;
};

}  // namespace pheromone::petri
