// The interface of all robots of a simulation: a station on a radio medium that moves on a plane
// and steers by the server's answers.
//
//   std::unique_ptr<MobileRobot> robot = ...;      // SimulatedRobot, HostPioneerRobot, AvrRobot
//   for (int64_t ms = 1; ms <= end_ms; ++ms) {
//     medium.AdvanceTo(ms * 1'000'000);
//     robot->Step();
//   }
//   robot->true_pose(); robot->counters();
//
// Units: metres and radians for poses, mm/s for wheels, 1/4096 of a pheromone unit for P_L and P_R.
// The medium must outlive the robot, and the robot the medium's last event. One thread.
#pragma once

#include <cstdint>

#include "client_fw/core/counters.h"
#include "client_fw/core/steering/steering.h"
#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/core/tasks/forager.h"
#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/radio_medium.h"

namespace pheromone::sim {

class MobileRobot : public Station {
 public:
  /// Catches up with the medium's present time; to be called every millisecond.
  virtual void Step() = 0;

  /// Its number on the medium.
  virtual int station() const = 0;
  virtual const PlanePose& true_pose() const = 0;
  /// The last speeds given to its drive; if these are unknown, the speeds of its wheels.
  virtual client::WheelSpeeds wheels() const = 0;
  /// If its counters cannot be read, those that its modem can count (RadioTally).
  virtual client::Counters counters() const = 0;
  /// As last received; 0 before.
  virtual int16_t p_left() const = 0;
  virtual int16_t p_right() const = 0;
  /// A set of client::StopFlag; 0 if they cannot be read.
  virtual uint8_t flags() const { return 0; }
  /// Its load is held; a cleaning robot's brush is on, a forager has energy.
  virtual bool HoldsLoad() const { return false; }
  /// Null if it does not clean, is switched off, or what it does cannot be read.
  virtual const client::Cleaner* cleaner() const { return nullptr; }
  /// Null if it carries no net, is switched off, or what it does cannot be read.
  virtual const client::Forager* forager() const { return nullptr; }
  /// How often it has run into an obstacle.
  virtual uint32_t bumps() const { return 0; }
};

}  // namespace pheromone::sim
