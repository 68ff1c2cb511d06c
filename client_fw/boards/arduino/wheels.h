// What a robot of the Arduino library drives with: TwoWheels (two_wheels.h), Steppers (steppers.h),
// or a class of your own. For loop(), never for interrupts.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/steering/drive_status.h"

namespace pheromone {
namespace arduino {

/// What a wheel rolls in one of the parts of a turn, ticks or steps, in nm.
constexpr uint32_t RollNm(double diameter_mm, double parts) {
  return static_cast<uint32_t>(3141593 * diameter_mm / parts);
}

/// Between the planes of the wheels.
constexpr uint32_t TrackUm(double mm) {
  return static_cast<uint32_t>(1000 * mm);
}

class PheromoneWheels {
 public:
  virtual void begin() = 0;
  /// As often as loop() comes round. True if odometry may be another one now.
  virtual bool step(uint16_t now_ms) = 0;
  /// Odometry goes on from here: after a reset that kept memory.
  virtual void resume(const client::Odometry& from) = 0;

  // As of client_fw/core/robot.h.
  virtual bool odometry(client::Odometry* to) = 0;
  virtual void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) = 0;
  virtual void emergency_stop() = 0;
  const client::DriveStatus& status() const { return status_; }

 protected:
  ~PheromoneWheels() = default;

  client::DriveStatus status_ = client::kNothingToTell;
};

}  // namespace arduino
}  // namespace pheromone
