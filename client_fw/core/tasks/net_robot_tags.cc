// What a robot with a net reads and writes: its number, the tags in range, their records. The
// other part is net_robot.cc.
#include "client_fw/core/requests/tag_data.h"
#include "client_fw/core/tasks/net_robot.h"
#include "client_fw/core/tasks/robot_name.h"
#include "protocol/byte_order.h"

namespace pheromone {
namespace client {
namespace {

using protocol::EnvironmentRecord;
using protocol::GetI16;
using protocol::GetI32;
using protocol::GetU16;
using protocol::kNoSlot;
using protocol::NetAction;
using protocol::NetOutcome;
using protocol::NetRecordFault;
using protocol::PutU16;
using protocol::PutU32;
using protocol::RobotRecord;
using protocol::TransitionDoes;
using protocol::TriggerRecord;

// Longer than any robot waits in a queue: the environment erases a record that it has read.
constexpr uint16_t kRecordLeaseS = 3600;

NetAction ActionOf(TransitionDoes does) {
  switch (does) {
    case TransitionDoes::kPresent:
      return NetAction::kPresent;
    case TransitionDoes::kStoreA:
      return NetAction::kStoreA;
    case TransitionDoes::kStoreB:
      return NetAction::kStoreB;
    case TransitionDoes::kTake:
      return NetAction::kTake;
    case TransitionDoes::kNothing:
      return NetAction::kNone;
    default:
      return NetAction::kLeave;
  }
}

// Of a point from here: at most an eighth too much.
uint16_t DistanceMm(int32_t dx_mm, int32_t dy_mm) {
  const uint32_t x = static_cast<uint32_t>(dx_mm < 0 ? -dx_mm : dx_mm);
  const uint32_t y = static_cast<uint32_t>(dy_mm < 0 ? -dy_mm : dy_mm);
  const uint32_t mm = x > y ? x + y / 2 : y + x / 2;
  return static_cast<uint16_t>(mm < UINT16_MAX ? mm : UINT16_MAX);
}

}  // namespace

void NetRobot::AskForName() {
  paced_ms_ = now_ms_;
  Ask(protocol::kSymbol, PutRobotName("forager-", id_, exchange_.message.data));
}

// --- Which tags are in range

void NetRobot::Look(uint16_t after) {
  paced_ms_ = now_ms_;
  if (after == 0) {
    in_range_ = false;
    seen_ = 0;
    nearest_ = 0;
  }
  PutU16(exchange_.message.data + kScanAfter, after);
  Ask(protocol::kScan, kScanSize);
}

void NetRobot::OnLook() {
  const uint8_t* const end = answer() + exchange_.message.length;
  uint16_t tag = 0;
  for (const uint8_t* row = answer() + kScannedRows; row != end; row += kScannedRowSize) {
    tag = GetU16(row + kRowTag);
    OnTagInRange(tag, DistanceMm(int32_t{GetI16(row + kRowDx)} * pose_unit_10um_ / 100,
                                 int32_t{GetI16(row + kRowDy)} * pose_unit_10um_ / 100));
  }
  if (answer()[kScannedMore] != 0 && tag != 0) {
    Look(tag);
    return;
  }
  if (state_.tag != 0 && !in_range_) {  // from now on it may be captured again
    state_.tag = 0;
    Save();
  }
  uint8_t kept = 0;
  for (uint8_t i = 0; i < ignored_count_; ++i) {
    if ((seen_ & 1u << i) != 0) {
      ignored_[kept++] = ignored_[i];
    }
  }
  ignored_count_ = kept;
  if (nearest_ != 0) {
    tag_ = nearest_;
    Go(Phase::kReading);
  }
}

void NetRobot::OnTagInRange(uint16_t tag, uint16_t distance_mm) {
  if (tag == state_.tag) {
    in_range_ = true;
    return;
  }
  for (uint8_t i = 0; i < ignored_count_; ++i) {
    if (ignored_[i] == tag) {
      seen_ = static_cast<uint8_t>(seen_ | 1u << i);
      return;
    }
  }
  if ((parameters_.capture_mm == 0 || distance_mm <= parameters_.capture_mm) &&
      (nearest_ == 0 || distance_mm < nearest_mm_)) {
    nearest_ = tag;
    nearest_mm_ = distance_mm;
  }
}

// --- What the tag fires

void NetRobot::Read(uint8_t slot) {
  paced_ms_ = now_ms_;
  ++polls_;
  PutU16(exchange_.message.data + kReadTag, tag_);
  exchange_.message.data[kReadSlot] = slot;
  Ask(protocol::kTagRead, kReadSize);
}

const uint8_t* NetRobot::statement() const {
  return answer() + kBlockStatement;
}

// The block may be one of a later slot, or none.
void NetRobot::OnTrigger() {
  const uint8_t slot = answer()[kBlockSlot];
  const bool is_record = slot != kNoSlot && protocol::IsNetRecord(statement());
  if (slot == protocol::kTriggerSlot && is_record) {
    TriggerRecord trigger = TriggerRecord();
    record_fault_ = protocol::Decode(statement(), net_.hash, &trigger);
    if (record_fault_ == NetRecordFault::kNone) {
      Capture(trigger);
    } else {
      Raise(NetFault::kRecord);
    }
  } else if (slot == protocol::kTriggerSlot) {
    slot_ = protocol::kEnvironmentSlot;
  } else if (slot == protocol::kEnvironmentSlot && is_record) {
    // A tag of the bench without its trigger vector. The environment writes it again.
    slot_ = protocol::kTriggerSlot;
    if (polls_ >= kNetPatience) {
      Raise(NetFault::kMissing);
    }
  } else {
    if (ignored_count_ < kIgnored) {
      ignored_[ignored_count_++] = tag_;
    }
    Go(Phase::kDriving);
  }
}

// u is one of the tag's transitions: the one that is enabled, under the conditions of the choice.
void NetRobot::Capture(const TriggerRecord& trigger) {
  for (uint8_t i = 0; i < trigger.count; ++i) {
    const uint8_t number = trigger.candidates[i];
    if (number > net_.transition_count) {
      record_fault_ = NetRecordFault::kValue;
      Raise(NetFault::kRecord);
      return;
    }
    const NetTransitionRow& row = net_.transitions[number - 1];
    uint32_t marking = state_.marking;
    if (!IsChosen(row.does) || Fire(row.arcs, &marking) != Firing::kFired) {
      continue;
    }
    state_.transition = number;
    state_.tag = tag_;
    if (row.does == TransitionDoes::kNothing) {
      Arrive(marking);
      return;
    }
    const NetAction action = ActionOf(row.does);
    const bool stores = action == NetAction::kStoreA || action == NetAction::kStoreB;
    Begin(action, action == NetAction::kTake ? parameters_.capacity
                  : stores                   ? Deposit()
                                             : uint16_t{0});
    return;
  }
  Raise(NetFault::kNotEnabled);
}

bool NetRobot::IsChosen(TransitionDoes does) const {
  return does == TransitionDoes::kLeaveA   ? state_.choice == NetAction::kChooseA
         : does == TransitionDoes::kLeaveB ? state_.choice == NetAction::kChooseB
                                           : true;
}

// --- Telling it

void NetRobot::Begin(NetAction action, uint16_t amount) {
  state_.stage = NetStage::kTelling;
  state_.action = action;
  state_.amount = amount;
  ++state_.seq;
  Save();
  Go(Phase::kTelling);
}

void NetRobot::Write() {
  ++polls_;
  paced_ms_ = now_ms_;
  uint8_t* const data = exchange_.message.data;
  PutU16(data + kWriteTag, tag_);
  data[kWriteSlot] = kNoSlot;
  // A choice is made for the advice that was read.
  data[kWriteFlags] = IsChoice(state_.action) ? protocol::kTagExpect : uint8_t{0};
  PutU16(data + kWriteExpected, IsChoice(state_.action) ? generation_ : uint16_t{0});
  PutU16(data + kWriteLease, kRecordLeaseS);
  PutU32(data + kWriteTime, 0);  // the server's
  protocol::Encode(RobotRecord{net_.hash, state_.seq, state_.action, state_.transition,
                               state_.amount, state_.energy},
                   data + kWriteWords);
  Ask(protocol::kTagWrite, kWriteSize);
}

// False if the answer is not the environment's record, which may be an exception.
bool NetRobot::ReadEnvironment(EnvironmentRecord* record) {
  generation_ = GetU16(answer() + kBlockTagGeneration);
  if (answer()[kBlockSlot] == protocol::kEnvironmentSlot) {
    record_fault_ = protocol::Decode(statement(), net_.hash, record);
  } else {
    record_fault_ = NetRecordFault::kNoRecord;
  }
  if (record_fault_ == NetRecordFault::kNone) {
    return true;
  }
  if (record_fault_ != NetRecordFault::kNoRecord) {
    Raise(NetFault::kRecord);
  } else if (polls_ >= kNetPatience) {
    Raise(NetFault::kMissing);
  }
  return false;
}

bool NetRobot::IsOutcome(const EnvironmentRecord& record) const {
  return record.robot == number_ && record.seq == state_.seq && record.outcome != NetOutcome::kNone;
}

// Whether the record has been handled, or stands on the tag. Neither: it was not written, or
// another robot's outcome has taken the place of ours. To write it again is right in both cases,
// since the environment knows a repetition by its seq.
void NetRobot::OnCheck() {
  const uint8_t slot = answer()[kBlockSlot];
  const uint16_t generation = GetU16(answer() + kBlockTagGeneration);
  if (slot_ != protocol::kEnvironmentSlot && generation != generation_) {
    slot_ = protocol::kEnvironmentSlot;  // it has changed on the way: once more
    return;
  }
  generation_ = generation;
  if (slot == protocol::kEnvironmentSlot) {
    EnvironmentRecord record = EnvironmentRecord();
    record_fault_ = protocol::Decode(statement(), net_.hash, &record);
    if (record_fault_ == NetRecordFault::kNone && IsOutcome(record)) {
      OnOutcome(record);
      return;
    }
    if (record_fault_ != NetRecordFault::kNone && record_fault_ != NetRecordFault::kNoRecord) {
      Raise(NetFault::kRecord);
      return;
    }
  } else if (slot != kNoSlot && GetI32(answer() + kBlockWords) == number_) {
    RobotRecord record = RobotRecord();
    if (protocol::Decode(statement(), net_.hash, &record) == NetRecordFault::kNone &&
        record.seq == state_.seq) {
      Go(Phase::kAwaiting);
      return;
    }
  }
  slot_ = slot == kNoSlot ? kNoSlot : answer()[kBlockNext];
  if (slot_ != kNoSlot) {
    return;
  }
  if (IsChoice(state_.action)) {  // the advice may be another one by now
    state_.stage = NetStage::kChoosing;
    Save();
    Go(Phase::kAdvice);
  } else {
    Go(Phase::kTelling);
  }
}

}  // namespace client
}  // namespace pheromone
