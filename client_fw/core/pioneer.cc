#include "client_fw/core/pioneer.h"

namespace pheromone {
namespace client {
namespace {

static_assert((INT32_C(-3) >> 1) == -2, "negative numbers must shift towards minus infinity");

// From one reading of X or Y to the next, wherever the counter wraps at 15 bits or at 16.
int16_t CountsSince(uint16_t before, uint16_t now) {
  const uint16_t difference = static_cast<uint16_t>((now - before) & 0x7FFFu);
  return static_cast<int16_t>(static_cast<int16_t>(difference ^ 0x4000u) - 0x4000);
}

// Adds one coordinate of a step to mm and what was left over. Not inlined: called twice.
__attribute__((noinline)) void Add(int16_t dx, int16_t per_dx_100nm, int16_t dy,
                                   int16_t per_dy_100nm, int32_t* mm, int16_t* rest_100nm) {
  const int32_t step_100nm = static_cast<int32_t>(dx) * per_dx_100nm +
                             static_cast<int32_t>(dy) * per_dy_100nm + *rest_100nm;
  // Unsigned, so that a very long distance merely wraps.
  *mm = static_cast<int32_t>(static_cast<uint32_t>(*mm) +
                             static_cast<uint32_t>(step_100nm / k100NmPerMm));
  *rest_100nm = static_cast<int16_t>(step_100nm % k100NmPerMm);
}

// To the nearest, halves up.
__attribute__((noinline)) int16_t TimesQ14(int16_t value, int16_t factor_q14) {
  return static_cast<int16_t>((static_cast<int32_t>(value) * factor_q14 + 8192) >> 14);
}

}  // namespace

Pioneer::Pioneer(uint16_t now_ms, int16_t count_100nm) : PioneerState() {
  due_ = kPhase;
  since_ms_ = now_ms;
  put_ms_ = now_ms;
  count_100nm_ = count_100nm;
}

void Pioneer::OnByte(uint8_t byte, uint16_t now_ms) {
  if (receiver_.Push(byte, now_ms)) {
    OnPacket(now_ms);
  }
}

void Pioneer::OnPacket(uint16_t now_ms) {
  if (receiver_.IsSip()) {
    if (phase_ == kOpen) {
      since_ms_ = now_ms;
      OnSip();
    } else if (phase_ != kClosing) {
      Enter(kClosing, now_ms);
    }
    return;
  }
  // An echo of a command that was not sent is left over from before.
  if (receiver_.id() != phase_ || due_ != 0) {
    return;
  }
  if (phase_ == kSync2) {
    // Until the first SIP gives the rotation of the axes.
    cos_100nm_ = receiver_.SubclassIsSh() ? k100NmPerMm : count_100nm_;
    Enter(kOpen, now_ms);
  } else {
    Enter(phase_ == kSync0 ? kSync1 : kSync2, now_ms);
  }
}

void Pioneer::Enter(Phase phase, uint16_t now_ms) {
  phase_ = phase;
  since_ms_ = now_ms;
  due_ = phase == kOpen ? kPhase | kSonar | kEnable | kSpeeds : kPhase;
  known_ = false;
  speeds_ = 0;
}

void Pioneer::OnSip() {
  Move();
  if (receiver_.HasStallAndFlags()) {
    stall_ = receiver_.Stall();
    flags_ = receiver_.Flags();
    if ((flags_ & (kMotorsOn | kStopPressed)) == 0) {
      due_ |= kEnable;
    }
    if ((flags_ & kSonarsOn) != 0) {
      due_ |= kSonar;
    }
  }
}

void Pioneer::Move() {
  const int16_t dx = CountsSince(x_, receiver_.X());
  const int16_t dy = CountsSince(y_, receiver_.Y());
  x_ = receiver_.X();
  y_ = receiver_.Y();
  const BinaryAngle heading = static_cast<BinaryAngle>(receiver_.Heading() << 4);
  if (!known_) {
    known_ = true;
    turned_ = static_cast<BinaryAngle>(odometry_.heading - heading);
    sin_100nm_ = TimesQ14(cos_100nm_, SinQ14(turned_));
    cos_100nm_ = TimesQ14(cos_100nm_, CosQ14(turned_));
    return;
  }
  odometry_.heading = static_cast<BinaryAngle>(heading + turned_);
  Add(dx, cos_100nm_, dy, static_cast<int16_t>(-sin_100nm_), &odometry_.x_mm, &x_rest_100nm_);
  Add(dx, sin_100nm_, dy, cos_100nm_, &odometry_.y_mm, &y_rest_100nm_);
}

void Pioneer::set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
  if (known_) {
    speeds_ = WheelWord(left_mm_s, right_mm_s);
    due_ |= kSpeeds;
  }
}

void Pioneer::Poll(uint16_t now_ms) {
  const uint16_t longest_ms = phase_ == kClosing ? kAfterCloseMs : kPioneerSilenceMs;
  if (static_cast<uint16_t>(now_ms - since_ms_) >= longest_ms) {
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
  if (first == kPhase) {
    tx_end_ = EncodeCommand(static_cast<PioneerCommand>(phase_ & 0x0F), tx_);
  } else if (first == kSonar) {
    tx_end_ = EncodeCommand(PioneerCommand::kSonar, 0, tx_);
  } else if (first == kEnable) {
    tx_end_ = EncodeCommand(PioneerCommand::kEnable, 1, tx_);
  } else {
    tx_end_ = EncodeCommand(PioneerCommand::kVel2, speeds_, tx_);
  }
}

void Pioneer::OnPut(uint16_t now_ms) {
  ++tx_at_;
  put_ms_ = now_ms;
}

}  // namespace client
}  // namespace pheromone
