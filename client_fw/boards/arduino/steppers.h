// Two stepper motors behind drivers with STEP and DIR (A4988, DRV8825, TMC2208). No encoders:
// odometry counts steps, so a wheel that slips or a motor that loses steps goes unnoticed.
//
//   constexpr StepperConfig kWheels = {63814, 160000, 400, 500, {2, 3}, {4, 5}, 0};
//   Steppers wheels(kWheels);
//   ISR(TIMER1_COMPA_vect) { wheels.tick(); }           // Steppers::kTicksPerSecond
//
// A wheel steps at most at every other tick. tick() is for an interrupt, all else for loop().
#pragma once

#include <Arduino.h>
#include <stdint.h>

#include "client_fw/boards/arduino/odometry.h"
#include "client_fw/boards/arduino/wheels.h"

namespace pheromone {
namespace arduino {

struct StepperPins {
  uint8_t step;
  uint8_t dir;  ///< low: forwards, unless the driver is told otherwise
};

struct StepperConfig {
  uint32_t step_nm;         ///< what a wheel rolls in a step
  uint32_t track_um;        ///< between the planes of the wheels
  int16_t full_speed_mm_s;  ///< what the motors can do without losing steps; at most 650
  int16_t acceleration_mm_s2;
  StepperPins left;
  StepperPins right;
  uint8_t reversed;  ///< bit 0: DIR of the left motor is high forwards; bit 1: of the right one
};

// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): it is never deleted
class Steppers final : public PheromoneWheels {
 public:
  static constexpr uint16_t kTicksPerSecond = 10000;

  explicit Steppers(const StepperConfig& config)
      : config_(config), odometry_(config.step_nm, config.track_um) {}

  void begin() override;
  bool step(uint16_t now_ms) override;
  void resume(const client::Odometry& from) override { odometry_.Set(from); }
  bool odometry(client::Odometry* to) override;
  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) override;
  /// At once, which may lose steps.
  void emergency_stop() override;

  /// For the interrupt.
  void tick() {
    left_.Tick();
    right_.Tick();
  }

 private:
  struct Motor {
    void Begin(const StepperPins& pins, bool is_reversed);
    void Tick();
    void Set(int16_t mm_s, uint32_t step_nm);

    int16_t target_mm_s = 0;
    int16_t speed_mm_s = 0;
    uint16_t counted = 0;
    bool reversed = false;
    uint8_t dir_pin = 0;
#ifdef __AVR__
    volatile uint8_t* step_port = nullptr;
    uint8_t step_bit = 0;
#else
    uint8_t step_pin = 0;
#endif
    // The interrupt's.
    volatile uint16_t rate = 0;  // of 65 536 a tick; below 32 768
    uint16_t phase = 0;
    bool high = false;
    bool backwards = false;
    volatile uint16_t steps = 0;
  };

  int16_t Clamp(int16_t mm_s) const;
  void Ramp(Motor* motor, int16_t change_mm_s) const;
  static int16_t Stepped(Motor* motor);

  StepperConfig config_;
  WheelOdometry odometry_;
  Motor left_;
  Motor right_;
  uint16_t last_ms_ = 0;
  int16_t rest_um_s_ = 0;  // of the change of speeds
};

}  // namespace arduino
}  // namespace pheromone
