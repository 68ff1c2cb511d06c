// Records of Petri nets in blocks of virtual RFID tags: what the environment and the robots of a
// bench leave for each other (README.md, "Records of nets"). A record takes the 24 bytes of a
// block's statement; the block's author says whose it is.
//
//   uint8_t statement[kNetStatementSize];
//   Encode(RobotRecord{hash, seq, NetAction::kPresent, transition, 0, 0}, statement);
//   EnvironmentRecord record;
//   if (Decode(statement, hash, &record) == NetRecordFault::kNone) ...
//
// Layout: i32 kTypeNetRecord, u8 version, u8 kind, u32 hash of the robots' net, 12 bytes by kind,
// u16 CRC of all after the i32. Freestanding; pure functions; any thread, any interrupt.
#pragma once

#include <stdint.h>

#include "protocol/tag_messages.h"

namespace pheromone {
namespace protocol {

constexpr uint8_t kNetStatementSize = 4 * kStatementWords;
constexpr uint8_t kNetRecordVersion = 1;
/// Candidate transitions of one tag.
constexpr uint8_t kMaxCandidates = 11;

enum class NetRecordKind : uint8_t { kTrigger = 1, kEnvironment = 2, kRobot = 3 };

/// Slots of a tag that the environment's reader writes. A robot's record is in any other one.
constexpr uint8_t kTriggerSlot = 0;
constexpr uint8_t kEnvironmentSlot = 1;

/// What a robot tells of. Those of an advice or trail A are followed by those of B.
enum class NetAction : uint8_t {
  kNone = 0,
  kPresent = 1,  ///< it stands on the tag, and waits for green
  kPass = 2,     ///< it has seen its green, and goes
  kLeave = 3,    ///< it is on an exit's tag
  kChooseA = 4,  ///< it takes trail A
  kChooseB = 5,
  kStoreA = 6,  ///< it has come by trail A; with an amount
  kStoreB = 7,
  kTake = 8,  ///< it asks for up to `amount` from the source
};
constexpr NetAction kLastNetAction = NetAction::kTake;

/// Bits of EnvironmentRecord::state.
enum NetState : uint8_t {
  kNetGreen = 0x01,    ///< for the robot of the record
  kNetAdviceA = 0x02,  ///< advice 01; neither: 00, any trail
  kNetAdviceB = 0x04,  ///< advice 10
};

enum class NetOutcome : uint8_t {
  kNone = 0,      ///< no robot's record yet
  kAccepted = 1,  ///< the transition was fired
  kRefused = 2,   ///< an exception: it was not enabled, or the record was not valid
};

/// The tag's trigger vector u (Ferreira et al. 2018, section 3): transitions of the robots' net,
/// counted from 1, of which a robot that captures the tag fires the one that is enabled.
struct TriggerRecord {
  uint32_t hash;
  uint8_t count;
  uint8_t candidates[kMaxCandidates];
};

/// What the environment's reader tells.
struct EnvironmentRecord {
  uint32_t hash;
  uint8_t state;       ///< a set of NetState
  NetOutcome outcome;  ///< of the record `seq` of `robot`
  int32_t robot;       ///< the author's number; 0: none
  uint8_t seq;
  uint16_t amount;  ///< granted to that robot
  uint16_t left;    ///< in the source
};

/// What a robot tells.
struct RobotRecord {
  uint32_t hash;
  uint8_t seq;  ///< by robot; another one for each record
  NetAction action;
  uint8_t transition;  ///< of the robot's net, counted from 1; for display
  uint16_t amount;
  uint16_t energy;  ///< what the robot has; for display
};

/// What is wrong with a record: the first that applies.
enum class NetRecordFault : uint8_t {
  kNone = 0,
  kNoRecord,  ///< a block of another kind
  kVersion,
  kCrc,
  kKind,   ///< a record, but not of the wanted kind
  kHash,   ///< of another net
  kValue,  ///< a value that its field does not have
};

/// Whether the statement is a record of any version and kind.
bool IsNetRecord(const uint8_t* statement);
/// The hash of a record's net, whatever else is wrong with it.
uint32_t NetHashOf(const uint8_t* statement);

void Encode(const TriggerRecord& from, uint8_t* statement);
void Encode(const EnvironmentRecord& from, uint8_t* statement);
void Encode(const RobotRecord& from, uint8_t* statement);

/// Only kNone has filled `to`; `hash` is that of the reader's own net.
NetRecordFault Decode(const uint8_t* statement, uint32_t hash, TriggerRecord* to);
NetRecordFault Decode(const uint8_t* statement, uint32_t hash, EnvironmentRecord* to);
NetRecordFault Decode(const uint8_t* statement, uint32_t hash, RobotRecord* to);

}  // namespace protocol
}  // namespace pheromone
