#include "client_fw/boards/arduino/steppers.h"

namespace pheromone {
namespace arduino {
namespace {

constexpr uint16_t kControlMs = 10;
constexpr uint16_t kMaxRate = 32767;
// A rate is mm/s * kRateNm / step_nm: 65 536 for a step a tick.
constexpr uint32_t kRateNm = 65536u * uint64_t{1000000} / Steppers::kTicksPerSecond;

}  // namespace

void Steppers::Motor::Begin(const StepperPins& pins, bool is_reversed) {
  reversed = is_reversed;
  dir_pin = pins.dir;
  pinMode(pins.dir, OUTPUT);
  pinMode(pins.step, OUTPUT);
#ifdef __AVR__
  step_port = portOutputRegister(digitalPinToPort(pins.step));
  step_bit = digitalPinToBitMask(pins.step);
#else
  step_pin = pins.step;
#endif
  digitalWrite(dir_pin, reversed ? HIGH : LOW);
}

// A step's pulse is a tick long.
void Steppers::Motor::Tick() {
  if (high) {
    high = false;
#ifdef __AVR__
    *step_port &= static_cast<uint8_t>(~step_bit);
#else
    digitalWrite(step_pin, LOW);
#endif
  }
  const uint16_t before = phase;
  phase = static_cast<uint16_t>(phase + rate);
  if (phase < before) {
    high = true;
#ifdef __AVR__
    *step_port |= step_bit;
#else
    digitalWrite(step_pin, HIGH);
#endif
    steps = static_cast<uint16_t>(steps + (backwards ? -1 : 1));
  }
}

void Steppers::Motor::Set(int16_t mm_s, uint32_t step_nm) {
  speed_mm_s = mm_s;
  const bool back = mm_s < 0;
  uint32_t a_tick = static_cast<uint32_t>(back ? -mm_s : mm_s) * kRateNm / step_nm;
  a_tick = a_tick > kMaxRate ? kMaxRate : a_tick;
  noInterrupts();
  if (back != backwards && mm_s != 0) {
    backwards = back;
    digitalWrite(dir_pin, back != reversed ? HIGH : LOW);
  }
  rate = static_cast<uint16_t>(a_tick);
  interrupts();
}

void Steppers::begin() {
  left_.Begin(config_.left, (config_.reversed & 1u) != 0);
  right_.Begin(config_.right, (config_.reversed & 2u) != 0);
  last_ms_ = static_cast<uint16_t>(millis());
}

bool Steppers::step(uint16_t now_ms) {
  const auto passed_ms = static_cast<uint16_t>(now_ms - last_ms_);
  if (passed_ms < kControlMs) {
    return false;
  }
  last_ms_ = now_ms;
  const int16_t left = Stepped(&left_);
  odometry_.Add(left, Stepped(&right_));
  const uint16_t counted_ms = passed_ms < 100 ? passed_ms : uint16_t{100};
  const int32_t change_um_s = int32_t{config_.acceleration_mm_s2} * counted_ms + rest_um_s_;
  const auto change = static_cast<int16_t>(change_um_s / 1000);
  rest_um_s_ = static_cast<int16_t>(change_um_s - int32_t{change} * 1000);
  Ramp(&left_, change);
  Ramp(&right_, change);
  return true;
}

bool Steppers::odometry(client::Odometry* to) {
  *to = odometry_.pose();
  return true;
}

void Steppers::set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
  left_.target_mm_s = Clamp(left_mm_s);
  right_.target_mm_s = Clamp(right_mm_s);
}

void Steppers::emergency_stop() {
  set_wheel_speeds(0, 0);
  left_.Set(0, config_.step_nm);
  right_.Set(0, config_.step_nm);
}

int16_t Steppers::Clamp(int16_t mm_s) const {
  const int16_t most = config_.full_speed_mm_s;
  return mm_s > most ? most : mm_s < -most ? static_cast<int16_t>(-most) : mm_s;
}

void Steppers::Ramp(Motor* motor, int16_t change_mm_s) const {
  const int16_t missing = static_cast<int16_t>(motor->target_mm_s - motor->speed_mm_s);
  if (missing == 0) {
    return;
  }
  const int16_t change = missing > change_mm_s    ? change_mm_s
                         : missing < -change_mm_s ? static_cast<int16_t>(-change_mm_s)
                                                  : missing;
  motor->Set(static_cast<int16_t>(motor->speed_mm_s + change), config_.step_nm);
}

int16_t Steppers::Stepped(Motor* motor) {
  noInterrupts();
  const uint16_t steps = motor->steps;
  interrupts();
  const auto stepped = static_cast<int16_t>(steps - motor->counted);
  motor->counted = steps;
  return stepped;
}

}  // namespace arduino
}  // namespace pheromone
