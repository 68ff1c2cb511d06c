// A robot that carries a Petri net inversely (iPNRD; Ferreira, Tavares and Silva 2018): it has the
// incidence matrix and the marking, a tag on the floor has the transitions that its capture may
// fire. What is to be told at a tag, and awaited there, is in protocol/README.md, "Records of
// nets". Without radio, wheels and clock: requests of TAG, answers and the time.
//
//   NetRobot robot(kRobotNet, parameters, id, boot_counter, &memory);
//   if (robot.Step(now)) conversation.Ask(robot.exchange());     // every millisecond or so
//   robot.drives(), robot.line()                                 // whether, and along which line
//   if (robot.TakeException(&tag)) ...                           // halt, and tell it
//
// A transition is fired wholly or not at all, and only after the environment has accepted it if it
// is told. An exception - none of a tag's transitions is enabled, contents of a tag that are no
// valid record of this net, a refusal - leaves the marking as it is. The robot then stands until it
// was held (halted) and released again, and tries once more.
//
// NetMemory survives a warm reset: at any point of the conversation, also in the middle of a
// change of that memory, the robot goes on, and each record has its effect once.
//
// No I/O, nothing allocated; one loop.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/moment.h"
#include "client_fw/core/medium/backoff.h"
#include "client_fw/core/requests/tag_exchange.h"
#include "client_fw/core/tasks/net_tables.h"
#include "protocol/net_record.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {

/// What is deposited for what was taken from the source.
enum class DepositRule : uint8_t {
  kEqual,   ///< as much
  kScaled,  ///< less what is burned on the way: at least 1 of anything
};

struct NetRobotParameters {
  DepositRule rule = DepositRule::kEqual;
  uint16_t burn_per_s = 1;      ///< kScaled: energy a second
  uint8_t explore_percent = 0;  ///< how often it takes any trail, whatever the advice
  uint16_t capacity = 100;      ///< energy that it takes at most
  uint16_t capture_mm = 0;      ///< how near to a tag it stops; 0: where the tag can be read
};

/// Why it stands.
enum class NetFault : uint8_t {
  kNone = 0,
  kNotEnabled,  ///< none of the tag's transitions is
  kRecord,      ///< the tag's contents: record_fault()
  kMissing,     ///< records are missing on a tag of the bench
  kRefused,     ///< by the environment
  kServer,      ///< a request of TAG was refused: reason()
};

/// What the robot is at, at a tag or between tags. Survives a warm reset.
enum class NetStage : uint8_t {
  kOnTheWay,
  kTelling,   ///< a record is to be written, or its outcome awaited
  kWaiting,   ///< for green
  kChoosing,  ///< for the advice
};

/// What survives. Plain memory.
struct NetState {
  uint32_t hash;  ///< of the net
  uint32_t marking;
  uint16_t nonce;    ///< of the boot that began with the initial marking
  uint16_t version;  ///< of this state: the newer of two counts
  uint16_t tag;      ///< where it stands; kOnTheWay: the last one, while it is in range; 0: none
  uint16_t amount;   ///< kTelling
  uint16_t energy;
  uint16_t carried_s;  ///< since it took it
  uint16_t trips;      ///< deposits
  NetStage stage;
  protocol::NetAction action;  ///< kTelling
  protocol::NetAction choice;  ///< kChooseA, kChooseB, or kNone
  uint8_t transition;          ///< kTelling: of the net, counted from 1
  uint8_t seq;                 ///< of the record; otherwise of the last one
  uint8_t unused;
  uint16_t crc;  ///< of all the above
};

/// Two, so that a reset in the middle of a change leaves one. Plain memory; a board keeps it in
/// RAM that a reset does not clear.
struct NetMemory {
  NetState states[2];
};

/// Since the last reset. Of trail A, then B.
struct NetCounters {
  uint32_t chosen[2];
  uint32_t stored[2];  ///< deposits
  uint32_t amount[2];  ///< deposited
  uint32_t taken;      ///< from the source
  uint32_t exceptions;
};

/// What a robot's loop tells NetRobot.
struct NetStep {
  Moment now_ms;
  uint16_t pace_ms;         ///< between looks for tags, and between two reads of an outcome
  uint16_t pose_unit_10um;  ///< the server's
  bool is_held;             ///< halted, or without a pose: nothing new is begun
};

/// How often a record is looked for on a tag that has others, and an outcome is read, until that is
/// an exception, or the robot looks whether its own record still stands.
constexpr uint8_t kNetPatience = 25;

class NetRobot {
 public:
  /// `memory` must outlive the robot. It counts if it was left by the same boot counter and net.
  NetRobot(const NetTables& net, const NetRobotParameters& parameters, uint8_t id,
           uint16_t boot_counter, NetMemory* memory);

  /// True if exchange() is to be sent. To be called again when its state is no longer kAsked, and
  /// before that as often as is convenient.
  bool Step(const NetStep& step);
  TagExchange* exchange() { return &exchange_; }

  /// It is on its way to the next tag, along line(): a pheromone type. Otherwise it stands.
  bool drives() const { return phase_ == Phase::kDriving; }
  uint8_t line() const { return line_; }
  /// True once after an exception at that tag.
  bool TakeException(uint16_t* tag);

  /// Of an exception, until the robot is released.
  NetFault fault() const { return fault_; }
  protocol::NetRecordFault record_fault() const { return record_fault_; }
  protocol::Reason reason() const { return reason_; }
  const NetCounters& counters() const { return counters_; }

  const NetState& state() const { return state_; }
  uint32_t marking() const { return state_.marking; }
  /// The marked place that does something, counted from 1.
  uint8_t place() const { return static_cast<uint8_t>(PlaceOf(state_.marking) - net_.places + 1); }
  /// Its number as an author; 0: not known yet.
  int32_t number() const { return number_; }
  /// The tag that it stands at; 0: none.
  uint16_t tag() const { return drives() ? uint16_t{0} : tag_; }

 private:
  enum class Phase : uint8_t {
    kNaming,
    kDriving,   // and looks for tags
    kReading,   // the trigger vector of tag_
    kTelling,   // a record is to be written
    kAwaiting,  // its outcome
    kGreen,
    kAdvice,
    kChecking,  // whether the record stands on the tag, or has been handled
    kException,
  };
  enum : uint8_t { kIgnored = protocol::kMaxTagsInRange };

  void Act();
  void OnAnswer();
  void OnRefusal();
  void OnDropped();
  void Go(Phase phase);
  void Resume();
  bool IsTime() const { return now_ms_ - paced_ms_ >= pace_ms_; }

  void AskForName();
  void Look(uint16_t after);
  void OnLook();
  void OnTagInRange(uint16_t tag, uint16_t distance_mm);
  void Read(uint8_t slot);
  void OnTrigger();
  void Capture(const protocol::TriggerRecord& trigger);
  bool IsChosen(protocol::TransitionDoes does) const;
  static bool IsChoice(protocol::NetAction action) {
    return action == protocol::NetAction::kChooseA || action == protocol::NetAction::kChooseB;
  }
  void Begin(protocol::NetAction action, uint16_t amount);
  void Write();
  bool ReadEnvironment(protocol::EnvironmentRecord* record);
  bool IsOutcome(const protocol::EnvironmentRecord& record) const;
  void OnOutcome(const protocol::EnvironmentRecord& record);
  void OnAccepted(uint16_t granted);
  void OnGreen();
  void OnAdvice();
  void OnCheck();
  void Arrive(uint32_t marking);
  uint16_t Deposit() const;
  void Raise(NetFault fault);

  void Save();
  void Carry(uint32_t passed_ms);
  uint8_t LineNow() const;
  const NetPlaceRow* PlaceOf(uint32_t marking) const;
  void Ask(uint8_t opcode, uint8_t length);
  const uint8_t* answer() const { return exchange_.message.data; }
  const uint8_t* statement() const;

  const NetTables& net_;
  NetRobotParameters parameters_;
  Random random_;
  uint8_t id_;
  NetMemory* memory_;
  NetState state_;
  Phase phase_ = Phase::kNaming;
  bool has_time_ = false;
  bool asked_ = false;   // exchange_ is under way
  bool raised_ = false;  // an exception has yet to be told
  uint8_t line_ = 0;
  uint8_t slot_ = 0;   // kReading, kChecking: to be read
  uint8_t polls_ = 0;  // in this phase
  uint8_t ignored_count_ = 0;
  bool in_range_ = false;  // kDriving: the last tag
  uint8_t seen_ = 0;       // kDriving: a bit for each of ignored_
  NetFault fault_ = NetFault::kNone;
  protocol::NetRecordFault record_fault_ = protocol::NetRecordFault::kNone;
  protocol::Reason reason_ = protocol::Reason::kNone;
  uint16_t tag_ = 0;      // where it stands
  uint16_t nearest_ = 0;  // kDriving: of those in range; 0: none
  uint16_t nearest_mm_ = 0;
  uint16_t generation_ = 0;  // of the tag, as read
  uint16_t pace_ms_ = 0;
  uint16_t pose_unit_10um_ = 100;
  uint32_t carried_ms_ = 0;
  int32_t number_ = 0;
  uint32_t now_ms_ = 0;
  uint32_t paced_ms_ = 0;  // of the last look or read
  NetCounters counters_ = {};
  uint16_t ignored_[kIgnored] = {};  // tags in range that are none of the bench
  TagExchange exchange_;
};

}  // namespace client
}  // namespace pheromone
