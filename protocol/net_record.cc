#include "protocol/net_record.h"

#include "protocol/byte_order.h"
#include "protocol/crc16.h"

namespace pheromone {
namespace protocol {
namespace {

enum At : uint8_t { kVersion = 4, kKind = 5, kHash = 6, kPayload = 10, kCrc = 22 };

uint16_t CrcOf(const uint8_t* statement) {
  return Crc16(statement + kVersion, kCrc - kVersion);
}

uint8_t* Begin(NetRecordKind kind, uint32_t hash, uint8_t* statement) {
  PutI32(statement, kTypeNetRecord);
  statement[kVersion] = kNetRecordVersion;
  statement[kKind] = static_cast<uint8_t>(kind);
  PutU32(statement + kHash, hash);
  for (uint8_t i = kPayload; i < kCrc; ++i) {
    statement[i] = 0;
  }
  return statement + kPayload;
}

void End(uint8_t* statement) {
  PutU16(statement + kCrc, CrcOf(statement));
}

NetRecordFault Check(const uint8_t* statement, NetRecordKind kind, uint32_t hash) {
  if (!IsNetRecord(statement)) {
    return NetRecordFault::kNoRecord;
  }
  if (statement[kVersion] != kNetRecordVersion) {
    return NetRecordFault::kVersion;
  }
  if (GetU16(statement + kCrc) != CrcOf(statement)) {
    return NetRecordFault::kCrc;
  }
  if (statement[kKind] != static_cast<uint8_t>(kind)) {
    return NetRecordFault::kKind;
  }
  return NetHashOf(statement) == hash ? NetRecordFault::kNone : NetRecordFault::kHash;
}

}  // namespace

bool IsNetRecord(const uint8_t* statement) {
  return GetI32(statement) == kTypeNetRecord;
}

uint32_t NetHashOf(const uint8_t* statement) {
  return GetU32(statement + kHash);
}

void Encode(const TriggerRecord& from, uint8_t* statement) {
  uint8_t* const to = Begin(NetRecordKind::kTrigger, from.hash, statement);
  const uint8_t count = from.count < kMaxCandidates ? from.count : kMaxCandidates;
  to[0] = count;
  for (uint8_t i = 0; i < count; ++i) {
    to[1 + i] = from.candidates[i];
  }
  End(statement);
}

void Encode(const EnvironmentRecord& from, uint8_t* statement) {
  uint8_t* const to = Begin(NetRecordKind::kEnvironment, from.hash, statement);
  to[0] = from.state;
  to[1] = static_cast<uint8_t>(from.outcome);
  PutI32(to + 2, from.robot);
  to[6] = from.seq;
  PutU16(to + 8, from.amount);
  PutU16(to + 10, from.left);
  End(statement);
}

void Encode(const RobotRecord& from, uint8_t* statement) {
  uint8_t* const to = Begin(NetRecordKind::kRobot, from.hash, statement);
  to[0] = from.seq;
  to[1] = static_cast<uint8_t>(from.action);
  to[2] = from.transition;
  PutU16(to + 4, from.amount);
  PutU16(to + 6, from.energy);
  End(statement);
}

NetRecordFault Decode(const uint8_t* statement, uint32_t hash, TriggerRecord* to) {
  const NetRecordFault fault = Check(statement, NetRecordKind::kTrigger, hash);
  if (fault != NetRecordFault::kNone) {
    return fault;
  }
  const uint8_t* const from = statement + kPayload;
  if (from[0] > kMaxCandidates) {
    return NetRecordFault::kValue;
  }
  for (uint8_t i = 0; i < from[0]; ++i) {
    if (from[1 + i] == 0) {
      return NetRecordFault::kValue;
    }
  }
  to->hash = hash;
  to->count = from[0];
  for (uint8_t i = 0; i < kMaxCandidates; ++i) {
    to->candidates[i] = from[1 + i];
  }
  return NetRecordFault::kNone;
}

NetRecordFault Decode(const uint8_t* statement, uint32_t hash, EnvironmentRecord* to) {
  const NetRecordFault fault = Check(statement, NetRecordKind::kEnvironment, hash);
  if (fault != NetRecordFault::kNone) {
    return fault;
  }
  const uint8_t* const from = statement + kPayload;
  constexpr uint8_t kBothAdvices = kNetAdviceA | kNetAdviceB;
  if (from[0] > (kNetGreen | kBothAdvices) || (from[0] & kBothAdvices) == kBothAdvices ||
      from[1] > static_cast<uint8_t>(NetOutcome::kRefused)) {
    return NetRecordFault::kValue;
  }
  to->hash = hash;
  to->state = from[0];
  to->outcome = static_cast<NetOutcome>(from[1]);
  to->robot = GetI32(from + 2);
  to->seq = from[6];
  to->amount = GetU16(from + 8);
  to->left = GetU16(from + 10);
  return NetRecordFault::kNone;
}

NetRecordFault Decode(const uint8_t* statement, uint32_t hash, RobotRecord* to) {
  const NetRecordFault fault = Check(statement, NetRecordKind::kRobot, hash);
  if (fault != NetRecordFault::kNone) {
    return fault;
  }
  const uint8_t* const from = statement + kPayload;
  if (from[1] == 0 || from[1] > static_cast<uint8_t>(kLastNetAction)) {
    return NetRecordFault::kValue;
  }
  to->hash = hash;
  to->seq = from[0];
  to->action = static_cast<NetAction>(from[1]);
  to->transition = from[2];
  to->amount = GetU16(from + 4);
  to->energy = GetU16(from + 6);
  return NetRecordFault::kNone;
}

}  // namespace protocol
}  // namespace pheromone
