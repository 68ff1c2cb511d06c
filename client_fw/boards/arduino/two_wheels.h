// Two wheels with motors and encoders.
//
//   void power(int16_t left, int16_t right) { ... }     // -255 to 255, to the motors' driver
//   void ticks(int16_t* left, int16_t* right) { ... }   // of the encoders, forwards up
//   constexpr WheelConfig kWheels = {152716, 141000, 500};
//   TwoWheels wheels(power, ticks, kWheels);
//
// Ticks may wrap.
//
// Every 10 ms each wheel's power is what its speed needs by `full_speed_mm_s`, and 5/s times the
// way that it lags behind what was asked for, which is at most 50 mm: so coarse encoders will do,
// and slow speeds are kept. A wheel that stands for a second at a quarter of the power or more is
// stalled, and the robot halts.
#pragma once

#include <stdint.h>

#include "client_fw/boards/arduino/odometry.h"
#include "client_fw/boards/arduino/wheels.h"

namespace pheromone {
namespace arduino {

struct WheelConfig {
  uint32_t tick_nm;         ///< what a wheel rolls in a tick of its encoder; to 10 mm
  uint32_t track_um;        ///< between the planes of the wheels
  int16_t full_speed_mm_s;  ///< at power 255, with a battery that is nearly empty
};

// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): it is never deleted
class TwoWheels final : public PheromoneWheels {
 public:
  using Power = void (*)(int16_t left, int16_t right);
  using Ticks = void (*)(int16_t* left, int16_t* right);

  constexpr TwoWheels(Power power, Ticks ticks, const WheelConfig& config)
      : power_(power), ticks_(ticks), config_(config), odometry_(config.tick_nm, config.track_um) {}

  void begin() override;
  bool step(uint16_t now_ms) override;
  void resume(const client::Odometry& from) override { odometry_.Set(from); }
  bool odometry(client::Odometry* to) override;
  /// Clamped to full speed.
  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) override;
  void emergency_stop() override;

 private:
  struct Wheel {
    int16_t target_mm_s = 0;
    int16_t ticks = 0;         // as last read
    uint16_t standing_ms = 0;  // at a quarter of the power or more
    int32_t lag_um = 0;
  };

  /// What its power is to be.
  int16_t Control(Wheel* wheel, int16_t rolled, uint16_t passed_ms) const;

  Power power_;
  Ticks ticks_;
  WheelConfig config_;
  WheelOdometry odometry_;
  Wheel wheels_[2];  // the left one first
  uint16_t last_ms_ = 0;
};

}  // namespace arduino
}  // namespace pheromone
