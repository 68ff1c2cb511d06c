// The effects of answers and commands on the robot; see conversation.cc.
#include "client_fw/core/conversation.h"

namespace pheromone {
namespace client {
namespace {

using protocol::CommandCode;
using protocol::EventCode;
using protocol::Reason;

// A lost robot's spiral: it turns left as if this intensity were sensed there, decreasing by a 32nd
// at each answer.
constexpr int16_t kFirstSpiral = kIntensityUnit / 4 * 3;

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
  if (command_known_ && data[0] == ack_[0]) {
    Count(&Counters::repeated_commands);
    return;
  }
  command_known_ = true;
  ack_[0] = data[0];
  ack_[1] = data[1];
  const Reason result = Execute(data[1], data + 2);
  ack_[2] = static_cast<uint8_t>(result);
  Count(result == Reason::kNone ? &Counters::commands : &Counters::refused_commands);
}

Reason Conversation::Execute(uint8_t code, const uint8_t* arguments) {
  switch (static_cast<CommandCode>(code)) {
    case CommandCode::kHalt:
      SetFlags(kHalted, 0);
      break;
    case CommandCode::kResume:
      SetFlags(0, kHalted);
      break;
    case CommandCode::kSpeed:
      return Change(kSpeedSetting, protocol::GetU16(arguments));  // negative: too fast
    case CommandCode::kFollowType:
      return Change(kTypeSetting, arguments[0]);
    case CommandCode::kPickLoad:
      load_ = true;
      Report(BitOf(EventCode::kLoadPicked));
      break;
    case CommandCode::kDropLoad:
      load_ = false;
      Report(BitOf(EventCode::kLoadDropped));
      break;
    case CommandCode::kSetParameter: {
      const Reason result = Change(arguments[0], protocol::GetU32(arguments + 1));
      save_ |= result == Reason::kNone;
      return result;
    }
    case CommandCode::kGetParameter: {
      int16_t value = 0;
      value_id_ = arguments[0];
      if (!ReadSetting(value_id_, parameters_, &value)) {
        return Reason::kBadValue;
      }
      Report(BitOf(EventCode::kParameterValue));
      break;
    }
    default:
      return Reason::kNotPermitted;
  }
  return Reason::kNone;
}

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

bool Conversation::HasType(uint8_t type) const {
  return type != 0 && (protocol::GetU16(server_ + kTypeMaskAt) >> type & 1) != 0;
}

bool Conversation::TakeSettingsChanged() {
  const bool save = save_;
  save_ = false;
  return save;
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

void Conversation::Stop(StopFlag flag, uint8_t event_bit) {
  if ((flags_ & flag) == 0) {
    Count(flag == kFailSafe ? &Counters::fail_safe_stops : &Counters::off_the_map_stops);
    SetFlags(flag, 0);
    Report(event_bit);
  }
}

}  // namespace client
}  // namespace pheromone
