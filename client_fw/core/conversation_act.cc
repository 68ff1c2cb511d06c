// The effects of answers and commands on the robot; see conversation.cc.
#include "client_fw/core/conversation.h"
#include "client_fw/core/outlined.h"

namespace pheromone {
namespace client {
namespace {

using protocol::CommandCode;
using protocol::EventCode;
using protocol::Reason;

// A lost robot's spiral: it turns left as if this intensity were sensed there, decreasing by a 32nd
// at each answer.
constexpr int16_t kFirstSpiral = kIntensityUnit / 4 * 3;

constexpr uint16_t kBatteryLowForMs = 5000;
constexpr uint8_t kBatteryRecovers100mv = 5;

}  // namespace

void Conversation::OnCommand(const uint8_t* data, uint8_t length) {
  if (length < 2 || length != 2 + protocol::CommandArgumentLength(data[1])) {
    Count(&Counters::malformed);
    return;
  }
  HearServer();
  // With turns, a ROUND follows, which takes longer than a window, and has a turn for the ACK.
  timers_[kAckDue] = HasTurns() ? timers_[kRounds] : static_cast<uint16_t>(WindowMs() + 1);
  ack_due_ = true;
  uint8_t* const ack = memory_->ack;
  if (memory_->command_known && data[0] == ack[0]) {
    Count(&Counters::repeated_commands);
    return;
  }
  memory_->command_known = true;
  ack[0] = data[0];
  ack[1] = data[1];
  const Reason result = Execute(data[1], data + 2);
  ack[2] = static_cast<uint8_t>(result);
  Count(result == Reason::kNone ? &Counters::commands : &Counters::refused_commands);
}

Reason Conversation::Execute(uint8_t code, const uint8_t* arguments) {
  switch (static_cast<CommandCode>(code)) {
    case CommandCode::kHalt:
      Halt();
      break;
    case CommandCode::kResume:
      return Release();
    case CommandCode::kSpeed: {
      const uint16_t mm_s = protocol::GetU16(arguments);  // negative: too fast
      const Reason result = Change(kSpeedSetting, mm_s);
      if (result == Reason::kNone) {
        memory_->has_speed = true;
        memory_->speed_mm_s = static_cast<int16_t>(mm_s);
      }
      return result;
    }
    case CommandCode::kFollowType: {
      const Reason result = Change(kTypeSetting, arguments[0]);
      if (result == Reason::kNone) {
        memory_->type = arguments[0];
      }
      return result;
    }
    case CommandCode::kPickLoad:
      load_ = true;
      Report(BitOf(EventCode::kLoadPicked));
      break;
    case CommandCode::kDropLoad:
      load_ = false;
      Report(BitOf(EventCode::kLoadDropped));
      break;
    case CommandCode::kSetParameter: {
      const uint32_t value = protocol::GetU32(arguments + 1);
      return arguments[0] < kPoseX ? Store(arguments[0], value) : GivePose(arguments[0], value);
    }
    case CommandCode::kGetParameter:
      return Ask(arguments[0]);
    default:
      return Reason::kNotPermitted;
  }
  return Reason::kNone;
}

// For as long as the robot is not switched off.
Reason Conversation::Change(uint8_t id, uint32_t value) {
  const uint8_t type = parameters_.type;
  if (!WriteSetting(id, value, &parameters_)) {
    return Reason::kBadValue;
  }
  if (server_[kVersionAt] != 0 && !HasType(parameters_.type)) {  // 0: nobody has told the types
    parameters_.type = type;
    return Reason::kUnknownPheromone;
  }
  SetFlags(0, 0);
  return Reason::kNone;
}

// For good. What holds until the robot is switched off is not stored with it.
Reason Conversation::Store(uint8_t id, uint32_t value) {
  int16_t before = 0;
  ReadSetting(id, stored_, &before);
  const bool same = static_cast<uint32_t>(before) == value;
  if (!same && saves_left_ == 0) {
    return Reason::kBusy;
  }
  if (!WriteSetting(id, value, &stored_)) {
    return Reason::kBadValue;
  }
  const Reason result = Change(id, value);
  if (result != Reason::kNone) {
    WriteSetting(id, static_cast<uint32_t>(before), &stored_);
    return result;
  }
  if (id == kTypeSetting) {
    memory_->type = 0;
  } else if (id == kSpeedSetting) {
    memory_->has_speed = false;
  }
  if (!same) {
    if (saves_left_ == kMaxSavesAtOnce) {
      timers_[kSaving] = kSavingMs;
    }
    --saves_left_;
    save_ = true;
  }
  return Reason::kNone;
}

bool Conversation::TakeSettingsChanged() {
  const bool save = save_;
  save_ = false;
  return save;
}

// A pose that is not on the map is reported as such when it is used.
Reason Conversation::GivePose(uint8_t id, uint32_t value) {
  if (id == kPoseX) {
    given_pose_.x_mm = static_cast<int32_t>(value);
  } else if (id == kPoseY) {
    given_pose_.y_mm = static_cast<int32_t>(value);
  } else if (id == kPoseHeading && value <= UINT16_MAX) {
    given_pose_.heading = static_cast<BinaryAngle>(value);
    pose_given_ = true;
  } else {
    return Reason::kBadValue;
  }
  return Reason::kNone;
}

// The pose that was given is the one at this odometry. False while the robot does not know its
// pose.
bool Conversation::TakePose(const Odometry& odometry) {
  if (pose_given_) {
    pose_given_ = false;
    memory_->start = StartPose::Of(given_pose_, odometry);
    start_ = StartPose(memory_->start);
    SetFlags(0, kPoseLost);
    Seal(memory_);
  }
  return (flags_ & kPoseLost) == 0;
}

Reason Conversation::Ask(uint8_t id) {
  if (id >= kResetCause && id < kEndOfBoardDiagnostics) {
    board_value_ = id;
    return Reason::kNone;
  }
  if (id >= kEndOfBoardDiagnostics && id < kEndOfDiagnostics) {
    TellBoardValue(DiagnosticValue(id));
    return Reason::kNone;
  }
  if (!ReadSetting(id, parameters_, &value_)) {
    return Reason::kBadValue;
  }
  Report(BitOf(EventCode::kParameterValue));
  return Reason::kNone;
}

void Conversation::TellBoardValue(uint16_t value) {
  board_value_ = 0;
  value_ = value < INT16_MAX ? static_cast<int16_t>(value) : int16_t{INT16_MAX};
  Report(BitOf(EventCode::kParameterValue));
}

uint16_t Conversation::DiagnosticValue(uint8_t id) const {
  switch (id) {
    case kStopFlags:
      return flags_;
    case kAlarms:
      return drive_.alarms;
    case kBumperWord:
      return drive_.bumpers;
    case kBattery:
      return drive_.battery_100mv;
    case kFrontRange:
      return drive_.front_mm;
    case kRequestCount:
      return static_cast<uint16_t>(counters_.requests & UINT16_MAX);
    case kTimeoutCount:
      return static_cast<uint16_t>(counters_.timeouts & UINT16_MAX);
    case kCrcErrorCount:
      return static_cast<uint16_t>(decoder_counters_.crc_errors & UINT16_MAX);
    default:
      return static_cast<uint16_t>(counters_.fail_safe_stops & UINT16_MAX);
  }
}

// A robot that is released while it is held, or stopped by hand, would drive off when it is let go.
Reason Conversation::Release() {
  if (drive_.alarms != 0) {
    const bool blocked = (drive_.alarms & (kStallAlarm | kBumperAlarm)) != 0;
    return blocked ? Reason::kBlockedByObstacle : Reason::kNotPermitted;
  }
  memory_->halted = false;
  SetFlags(0, kHalted);
  return Reason::kNone;
}

void Conversation::Halt() {
  memory_->halted = true;
  SetFlags(kHalted, 0);
}

void Conversation::LosePose() {
  SetFlags(kPoseLost, 0);
  Report(BitOf(EventCode::kPoseLost));
  Halt();
}

void Conversation::OnDrive(const DriveStatus& status) {
  const uint8_t before = drive_.alarms;
  drive_ = status;
  if (!parameters_.bumpers) {
    drive_.alarms = static_cast<uint8_t>(drive_.alarms & ~kBumperAlarm);
  }
  WatchBattery();
  const uint8_t appeared = static_cast<uint8_t>(drive_.alarms & ~before);
  if (appeared == 0) {
    return;
  }
  if ((appeared & (kStallAlarm | kBumperAlarm)) != 0) {
    bumped_ = status.bumpers;
    Report(BitOf(EventCode::kObstacle));
  }
  if ((appeared & (kStopButtonAlarm | kMotorsOffAlarm)) != 0) {
    Report(BitOf(EventCode::kStoppedByHand));
  }
  if ((appeared & kPoseLostAlarm) != 0) {
    LosePose();
  }
  emergency_ = true;
  Halt();
  Seal(memory_);
}

// The voltage dips whenever the robot accelerates: only what stays low is reported, and once.
void Conversation::WatchBattery() {
  const uint8_t low = parameters_.low_battery_100mv;
  const uint8_t now = drive_.battery_100mv;
  if (now == 0 || now >= low) {
    timers_[kBatteryDip] = kBatteryLowForMs;
    battery_told_ &= now < low + kBatteryRecovers100mv;
  } else if (timers_[kBatteryDip] == 0 && !battery_told_) {
    battery_told_ = true;
    Report(BitOf(EventCode::kBatteryLow));
  }
}

bool Conversation::TakeEmergency() {
  const bool emergency = emergency_;
  emergency_ = false;
  return emergency;
}

bool Conversation::HasType(uint8_t type) const {
  return type != 0 && (protocol::GetU16(server_ + kTypeMaskAt) >> type & 1) != 0;
}

// Steers by the new intensities.
void Conversation::Smell() {
  const int16_t faintest = parameters_.faintest;
  const bool sensed =
      p_left_ >= faintest || p_left_ <= -faintest || p_right_ >= faintest || p_right_ <= -faintest;
  searching_ =
      !sensed && parameters_.lost_after_ms != 0 && parameters_.lost_trail == LostTrail::kSearch;
  Notice(p_left_, p_right_, heading_, &careful_);
  if (sensed || (flags_ & kNoAnswerYet) != 0) {
    timers_[kSmelled] = parameters_.lost_after_ms;
    trail_lost_ = false;
  } else if (timers_[kSmelled] == 0 && parameters_.lost_after_ms != 0 && !trail_lost_) {
    trail_lost_ = true;
    careful_ = kCarefulStart;
    spiral_ = parameters_.lost_trail == LostTrail::kSpiral ? kFirstSpiral : 0;
    Count(&Counters::lost_trails);
    Report(BitOf(EventCode::kTrailLost));
  }
  spiral_ = static_cast<int16_t>(spiral_ - spiral_ / 32);
  const bool stops =
      parameters_.lost_trail == LostTrail::kStop || parameters_.lost_trail == LostTrail::kSearch;
  SetFlags(trail_lost_ && stops ? kTrailLost : 0,
           kNoAnswerYet | kFailSafe | kOffTheMap | kTrailLost);
}

void Conversation::SetFlags(uint8_t set, uint8_t clear) {
  flags_ = static_cast<uint8_t>((flags_ & ~clear) | set);
  wheels_ = WheelSpeeds{0, 0};
  if (flags_ != 0) {
    return;
  }
  const int16_t k_mm_s = parameters_.speed_mm_s;
  if (searching_) {
    wheels_ = Search(k_mm_s, careful_);
  } else if (trail_lost_) {
    wheels_ = Steer(Law::kDifferential, spiral_, 0, k_mm_s);
  } else if (parameters_.law == Law::kFuzzy) {
    wheels_ = SteerFuzzy(p_left_, p_right_, k_mm_s, kTunedFuzzy, &fuzzy_);
  } else if (parameters_.law == Law::kCareful) {
    wheels_ = SteerCareful(p_left_, p_right_, k_mm_s, parameters_.gain_8ths, careful_);
  } else {
    wheels_ = Steer(parameters_.law, p_left_, p_right_, k_mm_s, parameters_.gain_8ths);
  }
}

PHEROMONE_OUTLINED void Conversation::Report(uint16_t event_bit) {
  events_ = static_cast<uint16_t>(events_ | event_bit);
}

void Conversation::Stop(StopFlag flag, uint16_t event_bit) {
  if ((flags_ & flag) == 0) {
    Count(flag == kFailSafe ? &Counters::fail_safe_stops : &Counters::off_the_map_stops);
    SetFlags(flag, 0);
    emergency_ |= flag == kFailSafe;
    Report(event_bit);
  }
}

}  // namespace client
}  // namespace pheromone
