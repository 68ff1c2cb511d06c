#include "client_fw/core/steering/behaviour.h"

#include "client_fw/core/base/outlined.h"
#include "protocol/byte_order.h"
#include "protocol/messages.h"

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

Behaviour::Behaviour(const Parameters& parameters, RequestMemory* memory)
    : BehaviourVariables(),
      memory_(memory),
      fuzzy_(FuzzyState{kNoError}),
      careful_(kCarefulStart),
      state_(parameters, memory->start) {
  state_.flags = kNoAnswerYet;
  state_.load = memory_->load;
  if (memory_->type != 0) {
    state_.parameters.type = memory_->type;
  }
  if (memory_->has_speed) {
    state_.parameters.speed_mm_s = memory_->speed_mm_s;
  }
  if (parameters.pose_lost) {
    LosePose();
  }
  if (memory_->halted || !parameters.start_released) {
    Halt();
  }
  Seal(memory_);
}

Reason Behaviour::Execute(uint8_t code, const uint8_t* arguments) {
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
      memory_->load = state_.load = true;
      Report(BitOf(EventCode::kLoadPicked));
      break;
    case CommandCode::kDropLoad:
      memory_->load = state_.load = false;
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
Reason Behaviour::Change(uint8_t id, uint32_t value) {
  const uint8_t type = state_.parameters.type;
  if (!WriteSetting(id, value, &state_.parameters)) {
    return Reason::kBadValue;
  }
  if (types_known_ && !HasType(state_.parameters.type)) {
    state_.parameters.type = type;
    return Reason::kUnknownPheromone;
  }
  SetFlags(0, 0);
  return Reason::kNone;
}

// For good. What holds until the robot is switched off is not stored with it.
Reason Behaviour::Store(uint8_t id, uint32_t value) {
  int16_t before = 0;
  ReadSetting(id, state_.stored, &before);
  const bool same = static_cast<uint32_t>(before) == value;
  if (!same && saves_left_ == 0) {
    return Reason::kBusy;
  }
  if (!WriteSetting(id, value, &state_.stored)) {
    return Reason::kBadValue;
  }
  const Reason result = Change(id, value);
  if (result != Reason::kNone) {
    WriteSetting(id, static_cast<uint32_t>(before), &state_.stored);
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
    orders_ |= kSaveSettings;
  }
  return Reason::kNone;
}

// A pose that is not on the map is reported as such when it is used.
Reason Behaviour::GivePose(uint8_t id, uint32_t value) {
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

bool Behaviour::Locate(const Odometry& odometry) {
  if (pose_given_) {
    pose_given_ = false;
    memory_->start = StartPose::Of(given_pose_, odometry);
    state_.start = StartPose(memory_->start);
    SetFlags(0, kPoseLost);
    Seal(memory_);
  }
  return (state_.flags & kPoseLost) == 0;
}

// Of a setting, of what the robot does, or of what others know.
Reason Behaviour::Ask(uint8_t id) {
  uint16_t value = 0;
  switch (id) {
    case kStopFlags:
      value = state_.flags;
      break;
    case kAlarms:
      value = state_.drive.alarms;
      break;
    case kBumperWord:
      value = state_.drive.bumpers;
      break;
    case kBattery:
      value = state_.drive.battery_100mv;
      break;
    case kFrontRange:
      value = state_.drive.front_mm;
      break;
    case kFailSafeCount:
      value = static_cast<uint16_t>(state_.fail_safe_stops & UINT16_MAX);
      break;
    default:
      if (id >= kResetCause && id < kEndOfDiagnostics) {
        state_.value_wanted = id;
        return Reason::kNone;
      }
      if (!ReadSetting(id, state_.parameters, &value_)) {
        return Reason::kBadValue;
      }
      Report(BitOf(EventCode::kParameterValue));
      return Reason::kNone;
  }
  Tell(value);
  return Reason::kNone;
}

PHEROMONE_OUTLINED void Behaviour::Tell(uint16_t value) {
  state_.value_wanted = 0;
  value_ = value < INT16_MAX ? static_cast<int16_t>(value) : int16_t{INT16_MAX};
  Report(BitOf(EventCode::kParameterValue));
}

// A robot that is released while it is held, or stopped by hand, would drive off when it is let go.
PHEROMONE_OUTLINED Reason Behaviour::Release() {
  if (state_.drive.alarms != 0) {
    const bool blocked = (state_.drive.alarms & (kStallAlarm | kBumperAlarm)) != 0;
    return blocked ? Reason::kBlockedByObstacle : Reason::kNotPermitted;
  }
  memory_->halted = false;
  SetFlags(0, kHalted);
  return Reason::kNone;
}

void Behaviour::Halt() {
  memory_->halted = true;
  SetFlags(kHalted, 0);
}

void Behaviour::LosePose() {
  SetFlags(kPoseLost, 0);
  Report(BitOf(EventCode::kPoseLost));
  Halt();
}

void Behaviour::OnDrive(const DriveStatus& status) {
  const uint8_t before = state_.drive.alarms;
  state_.drive = status;
  if (!state_.parameters.bumpers) {
    state_.drive.alarms = static_cast<uint8_t>(state_.drive.alarms & ~kBumperAlarm);
  }
  WatchBattery();
  const uint8_t appeared = static_cast<uint8_t>(state_.drive.alarms & ~before);
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
  orders_ |= kStopAtOnce;
  Halt();
  Seal(memory_);
}

// The voltage dips whenever the robot accelerates: only what stays low is reported, and once.
void Behaviour::WatchBattery() {
  const uint8_t low = state_.parameters.low_battery_100mv;
  const uint8_t now = state_.drive.battery_100mv;
  if (now == 0 || now >= low) {
    timers_[kBatteryDip] = kBatteryLowForMs;
    battery_told_ &= now < low + kBatteryRecovers100mv;
  } else if (timers_[kBatteryDip] == 0 && !battery_told_) {
    battery_told_ = true;
    Report(BitOf(EventCode::kBatteryLow));
  }
}

void Behaviour::OnIntensities(int16_t left, int16_t right, BinaryAngle heading) {
  timers_[kAnswered] = state_.parameters.fail_safe_ms;
  state_.p_left = left;
  state_.p_right = right;
  const int16_t faintest = state_.parameters.faintest;
  const bool sensed =
      left >= faintest || left <= -faintest || right >= faintest || right <= -faintest;
  searching_ = !sensed && state_.parameters.lost_after_ms != 0 &&
               state_.parameters.lost_trail == LostTrail::kSearch;
  Notice(left, right, heading, &careful_);
  if (sensed || (state_.flags & kNoAnswerYet) != 0) {
    timers_[kSmelled] = state_.parameters.lost_after_ms;
    state_.trail_lost = false;
  } else if (timers_[kSmelled] == 0 && state_.parameters.lost_after_ms != 0 && !state_.trail_lost) {
    state_.trail_lost = true;
    careful_ = kCarefulStart;
    spiral_ = state_.parameters.lost_trail == LostTrail::kSpiral ? kFirstSpiral : 0;
    Report(BitOf(EventCode::kTrailLost));
  }
  spiral_ = static_cast<int16_t>(spiral_ - spiral_ / 32);
  const bool stops = state_.parameters.lost_trail == LostTrail::kStop ||
                     state_.parameters.lost_trail == LostTrail::kSearch;
  SetFlags(state_.trail_lost && stops ? kTrailLost : 0,
           kNoAnswerYet | kFailSafe | kOffTheMap | kTrailLost);
}

void Behaviour::SetFlags(uint8_t set, uint8_t clear) {
  state_.flags = static_cast<uint8_t>((state_.flags & ~clear) | set);
  state_.wheels = WheelSpeeds{0, 0};
  if (state_.flags != 0) {
    return;
  }
  const int16_t k_mm_s = state_.parameters.speed_mm_s;
  if (searching_) {
    state_.wheels = Search(k_mm_s, careful_);
  } else if (state_.trail_lost) {
    state_.wheels = Steer(Law::kDifferential, spiral_, 0, k_mm_s);
  } else if (state_.parameters.law == Law::kFuzzy) {
    state_.wheels = SteerFuzzy(state_.p_left, state_.p_right, k_mm_s, kTunedFuzzy, &fuzzy_);
  } else if (state_.parameters.law == Law::kCareful) {
    state_.wheels =
        SteerCareful(state_.p_left, state_.p_right, k_mm_s, state_.parameters.gain_8ths, careful_);
  } else {
    state_.wheels = Steer(state_.parameters.law, state_.p_left, state_.p_right, k_mm_s,
                          state_.parameters.gain_8ths);
  }
}

PHEROMONE_OUTLINED void Behaviour::Report(uint16_t event_bit) {
  state_.events = static_cast<uint16_t>(state_.events | event_bit);
}

PHEROMONE_BY_POINTER void Behaviour::Check() {
  if (timers_[kSaving] == 0 && saves_left_ != kMaxSavesAtOnce) {
    ++saves_left_;
    timers_[kSaving] = kSavingMs;
  }
  if (timers_[kAnswered] == 0 && (state_.flags & (kNoAnswerYet | kFailSafe)) == 0) {
    ++state_.fail_safe_stops;
    SetFlags(kFailSafe, 0);
    orders_ |= kStopAtOnce;
  }
}

void Behaviour::OnOffTheMap() {
  if ((state_.flags & kOffTheMap) == 0) {
    SetFlags(kOffTheMap, 0);
    Report(BitOf(EventCode::kOffTheMap));
  }
}

// Otherwise the channel is merely too full for an event.
void Behaviour::OnSilence() {
  if ((state_.flags & kFailSafe) != 0) {
    Report(BitOf(EventCode::kFailSafeStop));
  }
}

bool Behaviour::OnServer(uint8_t version, uint16_t types) {
  types_ = types;
  types_known_ = true;
  uint8_t set = 0;
  if (version != protocol::kProtocolVersion) {
    set = kWrongVersion;
  } else if (!HasType(state_.parameters.type)) {
    set = kTypeMissing;
  }
  SetFlags(set, kWrongVersion | kTypeMissing);
  return set == 0;
}

int16_t Behaviour::TakeEvent(EventCode* event) {
  uint8_t code = 1;
  while ((state_.events & BitOf(static_cast<EventCode>(code))) == 0) {
    ++code;
  }
  *event = static_cast<EventCode>(code);
  state_.events = static_cast<uint16_t>(state_.events ^ BitOf(*event));
  switch (*event) {
    case EventCode::kParameterValue:
      return value_;
    case EventCode::kObstacle:
      return static_cast<int16_t>(bumped_);
    case EventCode::kBatteryLow:
      return state_.drive.battery_100mv;
    default:
      return kHasTags && *event == EventCode::kNetException ? static_cast<int16_t>(exception_tag_)
                                                            : int16_t{0};
  }
}

void Behaviour::Follow(uint8_t type) {
  if (state_.parameters.type == type) {
    return;
  }
  state_.parameters.type = type;
  // Those that have arrived are another pheromone's.
  SetFlags(HasType(type) ? kNoAnswerYet : kNoAnswerYet | kTypeMissing, kTypeMissing);
}

void Behaviour::RaiseNetException(uint16_t tag) {
  exception_tag_ = tag;
  Report(BitOf(EventCode::kNetException));
  Halt();
  Seal(memory_);
}

bool Behaviour::Take(Order order) {
  const bool given = (orders_ & order) != 0;
  orders_ = static_cast<uint8_t>(orders_ & ~order);
  return given;
}

}  // namespace client
}  // namespace pheromone
