// What a robot does, without regard to how its messages travel: intensities, commands, what the
// drive tells and time go in; wheel speeds, events and orders for the board come out.
//
//   behaviour.Advance(elapsed_ms);
//   behaviour.OnDrive(status);                     // what the drive has to tell
//   behaviour.OnIntensities(left, right, heading); // an answer of the server
//   behaviour.Check();                             // stops the robot if there was none for long
//   drive.set_wheel_speeds(behaviour.state().wheels);
//
// Fail-safe: the wheels stand before the first intensities, and whenever there have been none for
// fail_safe_ms, until they arrive.
//
// Halt: after every reset the robot is halted, unless its settings say otherwise and it was not
// halted before; so is it by COMMAND 1 and by each alarm of the drive. Only COMMAND 2 releases it,
// and not while an alarm lasts. A robot that has lost its pose stands until it was given one
// (settings 64 to 66) and released.
//
// Of the RequestMemory it owns where odometry starts, the halt, and the values that are not stored.
// Nothing is allocated; one instance belongs to one loop.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/base/run_down.h"
#include "client_fw/core/requests/request_memory.h"
#include "client_fw/core/steering/careful.h"
#include "client_fw/core/steering/diagnostics.h"
#include "client_fw/core/steering/drive_status.h"
#include "client_fw/core/steering/fuzzy.h"
#include "client_fw/core/steering/parameters.h"
#include "client_fw/core/steering/steering.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace client {

/// Reasons for zero wheel speed. Any one of them suffices.
enum StopFlag : uint8_t {
  kNoAnswerYet = 0x01,   ///< none since the start
  kFailSafe = 0x02,      ///< answers stopped coming
  kHalted = 0x04,        ///< by a reset, a COMMAND or an alarm, until resume
  kOffTheMap = 0x08,     ///< the pose is not on the map; until an answer arrives
  kWrongVersion = 0x10,  ///< the server speaks another protocol version
  kTypeMissing = 0x20,   ///< the server has no such pheromone
  kTrailLost = 0x40,     ///< nothing sensed, and LostTrail::kStop or kSearch; until something is
  kPoseLost = 0x80,      ///< by a reset; until a pose was given
};

/// A pose is given by COMMAND 8 with these ids, the heading last: mm, mm, binary angle. Not stored.
enum PoseId : uint8_t { kPoseX = 64, kPoseY = 65, kPoseHeading = 66 };

/// Changes of settings are stored so often at once, and then one a minute: an EEPROM wears out.
/// More are refused as busy.
constexpr uint8_t kMaxSavesAtOnce = 8;
constexpr uint16_t kSavingMs = 60000;

/// What a behaviour asks of the robot, each time once.
enum Order : uint8_t {
  kStopAtOnce = 0x01,    ///< without regard to the drive's deceleration
  kSaveSettings = 0x02,  ///< BehaviourState::stored
};

/// All wrap.
struct BehaviourCounters {
  unsigned fail_safe_stops;  ///< stopped because answers were missing
};

struct BehaviourValues : BehaviourCounters {  // plain memory: all zero
  uint8_t flags;                              ///< a set of StopFlag; 0 while driving
  uint8_t value_wanted;  ///< the Diagnostic of others that is to be told, 0: none
  bool trail_lost;       ///< nothing has been sensed for lost_after_ms
  bool load;             ///< it is to be held, as commanded
  int16_t p_left;        ///< the last intensities, 1/4096 of a unit; 0 before the first
  int16_t p_right;
  WheelSpeeds wheels;
  uint16_t events;  ///< to be reported: a bit for each EventCode, the first is 1
};

struct BehaviourState : BehaviourValues {
  BehaviourState(const Parameters& given, const Pose& start_pose)
      : BehaviourValues(),
        parameters(given),
        stored(static_cast<const Settings&>(given)),
        drive(kNothingToTell),
        start(start_pose) {}

  Parameters parameters;  ///< those given, with the settings changed by COMMANDs
  Settings stored;        ///< without values that hold only until the robot is switched off
  DriveStatus drive;      ///< as last told, without alarms that the settings exclude
  StartPose start;        ///< places odometry on the map, if no flag says kPoseLost
};

/// What begins at zero, separate so that one loop can clear it as plain memory.
class BehaviourVariables {
 protected:
  enum Timer : uint8_t {
    kAnswered,    // since the last intensities: fail-safe
    kSmelled,     // until the trail counts as lost
    kBatteryDip,  // until a battery that is low all the time is reported
    kSaving,      // until one more change of the settings may be stored
    kTimers
  };

  uint16_t timers_[kTimers];
  uint8_t orders_;
  bool searching_;     // nothing is sensed, and lost_trail is kSearch
  bool pose_given_;    // given_pose_ is the present one
  bool battery_told_;  // to be low
  bool types_known_;
  int16_t value_;    // arguments of events
  uint16_t bumped_;  // the word of bumpers when the last one was reported
  uint16_t exception_tag_;
  int16_t spiral_;  // the intensity that makes a lost robot turn
  uint16_t types_;  // the server's pheromones
  Pose given_pose_;
};

class Behaviour : private BehaviourVariables {
 public:
  /// `memory`, which must outlive it, is of this boot.
  Behaviour(const Parameters& parameters, RequestMemory* memory);
  /// A copy with a memory of its own.
  Behaviour(const Behaviour& other, RequestMemory* memory) : Behaviour(other) { memory_ = memory; }

  const BehaviourState& state() const { return state_; }
  void SetAdapter(uint8_t adapter_ms, bool rounds) {
    state_.parameters.adapter_ms = adapter_ms;
    state_.parameters.rounds = rounds;
  }

  void Advance(uint16_t elapsed_ms) { RunDown(timers_, kTimers, elapsed_ms); }
  /// Once in each round of the loop, after Advance and what has been received.
  void Check();
  /// What the drive has to tell.
  void OnDrive(const DriveStatus& status);
  /// A pose that was given is the one at this odometry. False while the robot does not know its
  /// pose.
  bool Locate(const Odometry& odometry);

  /// HELLO has been answered: the server's protocol version and its pheromones, a bit for each.
  /// False if the robot cannot be its client.
  bool OnServer(uint8_t version, uint16_t types);
  /// In 1/4096 of a unit; `heading` is the pose's for which they were asked.
  void OnIntensities(int16_t left, int16_t right, BinaryAngle heading);
  /// The pose is not on the server's map.
  void OnOffTheMap();
  /// The server has been silent for so long that HELLO is said again.
  void OnSilence();
  /// A COMMAND with as many `arguments` as its code has. kNone: it was executed. The caller seals
  /// the memory.
  protocol::Reason Execute(uint8_t code, const uint8_t* arguments);
  /// COMMAND 2, not by a frame.
  protocol::Reason Resume() {
    const protocol::Reason result = Release();
    Seal(memory_);
    return result;
  }
  /// The value of state().value_wanted.
  void Tell(uint16_t value);
  /// The first event that is to be reported, its argument is returned; there is one.
  int16_t TakeEvent(protocol::EventCode* event);

  /// Steers by another pheromone, once its intensities have arrived. As COMMAND 5, but for a task;
  /// a reset forgets it.
  void Follow(uint8_t type);
  /// Halts, and tells the server so: an exception of a net at this tag.
  void RaiseNetException(uint16_t tag);
  /// Whether this order was given since it was last taken.
  bool Take(Order order);

 private:
  static constexpr uint16_t BitOf(protocol::EventCode event) {
    return static_cast<uint16_t>(1u << (static_cast<uint8_t>(event) - 1));
  }

  protocol::Reason Change(uint8_t id, uint32_t value);
  protocol::Reason Store(uint8_t id, uint32_t value);
  protocol::Reason GivePose(uint8_t id, uint32_t value);
  protocol::Reason Ask(uint8_t id);
  protocol::Reason Release();
  void Halt();
  void LosePose();
  void WatchBattery();
  bool HasType(uint8_t type) const { return type != 0 && (types_ >> type & 1) != 0; }
  void SetFlags(uint8_t set, uint8_t clear);
  void Stop(StopFlag flag, uint16_t event_bit);
  void Report(uint16_t event_bit);

  RequestMemory* memory_;
  uint8_t saves_left_ = kMaxSavesAtOnce;  // changes of settings that may be stored now
  FuzzyState fuzzy_;
  CarefulState careful_;
  BehaviourState state_;
};

}  // namespace client
}  // namespace pheromone
