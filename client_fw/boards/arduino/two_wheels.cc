#include "client_fw/boards/arduino/two_wheels.h"

#include <Arduino.h>

namespace pheromone {
namespace arduino {
namespace {

constexpr uint16_t kControlMs = 10;
constexpr uint16_t kMaxMs = 100;
constexpr int32_t kMaxLagUm = 50000;
constexpr int32_t kLagMs = 200;  // 5/s
constexpr int16_t kFullPower = 255;
constexpr int16_t kStallPower = 64;
constexpr uint16_t kStallMs = 1000;

int16_t Clamp(int16_t value, int16_t most) {
  return value > most ? most : value < -most ? static_cast<int16_t>(-most) : value;
}

}  // namespace

void TwoWheels::begin() {
  ticks_(&wheels_[0].ticks, &wheels_[1].ticks);
  last_ms_ = static_cast<uint16_t>(millis());
  power_(0, 0);
}

bool TwoWheels::step(uint16_t now_ms) {
  auto passed_ms = static_cast<uint16_t>(now_ms - last_ms_);
  if (passed_ms < kControlMs) {
    return false;
  }
  last_ms_ = now_ms;
  if (passed_ms > kMaxMs) {
    passed_ms = kMaxMs;
  }
  int16_t values[2];  // ticks, then ticks since the last time, then power
  ticks_(&values[0], &values[1]);
  for (uint8_t i = 0; i < 2; ++i) {
    const int16_t ticks = values[i];
    values[i] = static_cast<int16_t>(ticks - wheels_[i].ticks);
    wheels_[i].ticks = ticks;
  }
  odometry_.Add(values[0], values[1]);
  status_.alarms = 0;
  for (uint8_t i = 0; i < 2; ++i) {
    values[i] = Control(&wheels_[i], values[i], passed_ms);
    if (wheels_[i].standing_ms >= kStallMs) {
      status_.alarms = client::kStallAlarm;
    }
  }
  power_(values[0], values[1]);
  return true;
}

bool TwoWheels::odometry(client::Odometry* to) {
  *to = odometry_.pose();
  return true;
}

void TwoWheels::set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
  wheels_[0].target_mm_s = Clamp(left_mm_s, config_.full_speed_mm_s);
  wheels_[1].target_mm_s = Clamp(right_mm_s, config_.full_speed_mm_s);
}

void TwoWheels::emergency_stop() {
  set_wheel_speeds(0, 0);
  power_(0, 0);
}

int16_t TwoWheels::Control(Wheel* wheel, int16_t rolled, uint16_t passed_ms) const {
  if (wheel->target_mm_s == 0) {
    wheel->lag_um = 0;
    wheel->standing_ms = 0;
    return 0;
  }
  int32_t lag_um = wheel->lag_um + int32_t{wheel->target_mm_s} * passed_ms -
                   int32_t{rolled} * static_cast<int32_t>(config_.tick_nm) / 1000;
  lag_um = lag_um > kMaxLagUm ? kMaxLagUm : lag_um < -kMaxLagUm ? -kMaxLagUm : lag_um;
  wheel->lag_um = lag_um;
  const int32_t speed_mm_s = wheel->target_mm_s + lag_um / kLagMs;
  const int16_t power =
      Clamp(static_cast<int16_t>(speed_mm_s * kFullPower / config_.full_speed_mm_s), kFullPower);
  if (rolled != 0 || (power < kStallPower && power > -kStallPower)) {
    wheel->standing_ms = 0;
  } else if (wheel->standing_ms < kStallMs) {
    wheel->standing_ms = static_cast<uint16_t>(wheel->standing_ms + passed_ms);
  }
  return power;
}

}  // namespace arduino
}  // namespace pheromone
