#include "client_fw/core/pioneer/pioneer.h"

#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {
namespace {

static_assert((INT32_C(-3) >> 1) == -2, "negative numbers must shift towards minus infinity");

// From one reading of X or Y to the next, wherever the counter wraps at 15 bits or at 16.
PHEROMONE_OUTLINED int16_t CountsSince(uint16_t before, uint16_t now) {
  const uint16_t difference = static_cast<uint16_t>((now - before) & 0x7FFFu);
  return static_cast<int16_t>(static_cast<int16_t>(difference ^ 0x4000u) - 0x4000);
}

// Adds one coordinate of a step to mm and what was left over.
PHEROMONE_OUTLINED void Add(int16_t dx, int16_t per_dx_100nm, int16_t dy, int16_t per_dy_100nm,
                            int32_t* mm, int16_t* rest_100nm) {
  const int32_t step_100nm = static_cast<int32_t>(dx) * per_dx_100nm +
                             static_cast<int32_t>(dy) * per_dy_100nm + *rest_100nm;
  // Unsigned, so that a very long distance merely wraps.
  *mm = static_cast<int32_t>(static_cast<uint32_t>(*mm) +
                             static_cast<uint32_t>(step_100nm / k100NmPerMm));
  *rest_100nm = static_cast<int16_t>(step_100nm % k100NmPerMm);
}

// To the nearest, halves up.
PHEROMONE_OUTLINED int16_t TimesQ14(int16_t value, int16_t factor_q14) {
  return static_cast<int16_t>((static_cast<int32_t>(value) * factor_q14 + 8192) >> 14);
}

}  // namespace

Pioneer::Pioneer(uint16_t now_ms, int16_t count_100nm, bool with_sonar) : PioneerState() {
  due_ = kPhase;
  since_ms_ = now_ms;
  put_ms_ = now_ms;
  count_100nm_ = count_100nm;
  with_sonar_ = with_sonar;
  status_ = kNothingToTell;
  front_mm_ = kNoRange;
  last_front_mm_ = kNoRange;
}

void Pioneer::Restart(uint16_t now_ms, bool close_first) {
  Enter(close_first ? kClosing : kSync0, now_ms);
}

void Pioneer::Continue(const PioneerTrack& track) {
  track_ = track;
  phase_ = kContinuing;
  due_ = kEmergency;
}

bool Pioneer::OnByte(uint8_t byte, uint16_t now_ms) {
  if (!receiver_.Push(byte, now_ms)) {
    return false;
  }
  OnPacket(now_ms);
  return receiver_.IsSip();
}

void Pioneer::OnPacket(uint16_t now_ms) {
  if (receiver_.IsSip()) {
    if (phase_ == kContinuing) {
      Enter(kOpen, now_ms);
      due_ = static_cast<uint8_t>(due_ & ~kPhase);  // it is open
      known_ = true;
    }
    if (phase_ == kOpen) {
      since_ms_ = now_ms;
      OnSip();
    } else if (phase_ != kClosing) {
      Enter(kClosing, now_ms);
    }
    return;
  }
  // An echo of a command that was not sent is left over from before. To a Pioneer without a session
  // CLOSE is SYNC2: if it answers with its names, it takes itself to be in one.
  const uint8_t command = phase_ & 0x0Fu;
  if (phase_ >= kOpen || receiver_.id() != command || due_ != 0 ||
      (phase_ == kClosing && !receiver_.HasNames())) {
    return;
  }
  if (command == kSync2) {
    // Until the first SIP gives the rotation of the axes.
    track_.cos_100nm = receiver_.SubclassIsSh() ? k100NmPerMm : count_100nm_;
    Enter(kOpen, now_ms);
  } else {
    Enter(phase_ == kSync0 ? kSync1 : kSync2, now_ms);
  }
}

PHEROMONE_BY_POINTER void Pioneer::Enter(Phase phase, uint16_t now_ms) {
  phase_ = phase;
  since_ms_ = now_ms;
  due_ = phase == kOpen ? kPhase | kSonar | kDeceleration | kEnable | kSpeeds : kPhase;
  known_ = false;
  motors_used_ = false;
  speeds_ = 0;
  status_.front_mm = kNoRange;
  front_mm_ = kNoRange;
  last_front_mm_ = kNoRange;
}

void Pioneer::OnSip() {
  Move();
  ++sips_;
  LookAhead();
  if (receiver_.HasStallAndFlags()) {
    OnStatus();
  }
}

// What is nearer counts at once, what is farther once every sonar has said so.
PHEROMONE_BY_POINTER void Pioneer::LookAhead() {
  if (receiver_.FrontRange() < front_mm_) {
    front_mm_ = receiver_.FrontRange();
  }
  status_.front_mm = front_mm_ < last_front_mm_ ? front_mm_ : last_front_mm_;
  ++window_sips_;
  if (window_sips_ >= kSonarSips) {
    window_sips_ = 0;
    last_front_mm_ = front_mm_;
    front_mm_ = kNoRange;
  }
}

PHEROMONE_BY_POINTER void Pioneer::OnStatus() {
  status_.battery_100mv = receiver_.Battery();
  status_.bumpers = receiver_.Stall();
  flags_ = receiver_.Flags();
  uint8_t alarms = 0;
  if ((status_.bumpers & kStalls) != 0) {
    alarms |= kStallAlarm;
  }
  if ((status_.bumpers & ~kStalls) != 0) {
    alarms |= kBumperAlarm;
  }
  if ((flags_ & kStopPressed) != 0) {
    alarms |= kStopButtonAlarm;
  }
  if ((flags_ & kMotorsOn) != 0) {
    motors_used_ = true;
  } else if (motors_used_) {
    motors_used_ = false;
    alarms |= kMotorsOffAlarm;
  } else if (alarms == 0 && speeds_ != 0) {
    due_ |= kEnable;
  }
  status_.alarms = alarms;
  if (((flags_ & kSonarsOn) != 0) != with_sonar_) {
    due_ |= kSonar;
  }
}

void Pioneer::Move() {
  const int16_t dx = CountsSince(track_.x, receiver_.X());
  const int16_t dy = CountsSince(track_.y, receiver_.Y());
  track_.x = receiver_.X();
  track_.y = receiver_.Y();
  const BinaryAngle heading = static_cast<BinaryAngle>(receiver_.Heading() << 4);
  Odometry* const odometry = &track_.odometry;
  if (!known_) {
    known_ = true;
    track_.turned = static_cast<BinaryAngle>(odometry->heading - heading);
    track_.sin_100nm = TimesQ14(track_.cos_100nm, SinQ14(track_.turned));
    track_.cos_100nm = TimesQ14(track_.cos_100nm, CosQ14(track_.turned));
    return;
  }
  odometry->heading = static_cast<BinaryAngle>(heading + track_.turned);
  Add(dx, track_.cos_100nm, dy, static_cast<int16_t>(-track_.sin_100nm), &odometry->x_mm,
      &track_.x_rest_100nm);
  Add(dx, track_.sin_100nm, dy, track_.cos_100nm, &odometry->y_mm, &track_.y_rest_100nm);
}

void Pioneer::set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
  if (known_) {
    speeds_ = WheelWord(left_mm_s, right_mm_s);
    due_ |= kSpeeds;
  }
}

void Pioneer::emergency_stop() {
  speeds_ = 0;
  if (phase_ == kOpen) {
    due_ |= kEmergency | kSpeeds;
  }
}

void Pioneer::Poll(uint16_t now_ms) {
  const uint16_t longest_ms = phase_ == kClosing ? kAfterCloseMs : kPioneerSilenceMs;
  if (static_cast<uint16_t>(now_ms - since_ms_) >= longest_ms) {
    if (phase_ == kContinuing) {
      status_.alarms = kPoseLostAlarm;  // until the first SIP
    } else if (phase_ == kSync0) {
      ++track_.rate;
    }
    Enter(phase_ == kClosing ? kSync0 : kClosing, now_ms);
  }
  const uint16_t since_put_ms = static_cast<uint16_t>(now_ms - put_ms_);
  if (tx_size() != 0 || since_put_ms < kCommandGapMs) {
    return;
  }
  if (phase_ == kOpen && since_put_ms >= kKeepAliveMs) {
    due_ |= kSpeeds;
  }
  if (due_ != 0) {
    Send();
  }
}

void Pioneer::Send() {
  const uint8_t first = static_cast<uint8_t>(due_ & (0u - due_));
  due_ = static_cast<uint8_t>(due_ ^ first);
  tx_at_ = 0;
  if (first == kPhase || first == kEmergency) {
    tx_end_ = EncodeCommand(first == kPhase ? static_cast<PioneerCommand>(phase_ & 0x0F)
                                            : PioneerCommand::kEmergencyStop,
                            tx_);
    return;
  }
  PioneerCommand command = PioneerCommand::kVel2;
  int16_t argument = speeds_;
  if (first == kSonar) {
    command = PioneerCommand::kSonar;
    argument = with_sonar_;
  } else if (first == kDeceleration) {
    command = PioneerCommand::kSetAcceleration;
    argument = -kDecelerationMmS2;
  } else if (first == kEnable) {
    command = PioneerCommand::kEnable;
    argument = 1;
  }
  tx_end_ = EncodeCommand(command, argument, tx_);
}

void Pioneer::OnPut(uint16_t now_ms) {
  ++tx_at_;
  put_ms_ = now_ms;
}

}  // namespace client
}  // namespace pheromone
