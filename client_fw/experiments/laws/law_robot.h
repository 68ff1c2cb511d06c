// A robot whose steering law is chosen, and tuned, by an experiment: the firmware runs the
// conversation with the server, and the law under test converts each answer to wheel speeds.
//
//   LawRobot robot(config, {.law = client::Law::kDifferential, .gain_8 = 12}, &medium);
//   medium.AdvanceTo(...); robot.Step();               // every millisecond
//
// As in the firmware, the wheel speeds change when an answer arrives, and are zero while
// Conversation::flags() says so. With the same law and gains the robot drives as SimulatedRobot
// does (law_robot_test.cc). One thread.
#pragma once

#include <cstdint>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/core/robot.h"
#include "client_fw/core/steering/fuzzy.h"
#include "client_fw/core/steering/steering.h"
#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/mobile_robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/sim/simulated_robot.h"

namespace pheromone::swarm {

/// A law with all its tunable parameters.
struct Steering {
  client::Law law = client::Law::kDifferential;
  int16_t speed_mm_s = 300;                        ///< K
  uint8_t gain_8 = client::kUnitGain;              ///< of differential and paper, in 1/8
  client::FuzzyGains fuzzy = client::kTunedFuzzy;  ///< of fuzzy
};

class LawRobot final : public sim::MobileRobot {
 public:
  /// `config.client` has all parameters except steering. `medium` outlives the robot, and the robot
  /// the medium's last event.
  LawRobot(const sim::SimulatedRobotConfig& config, const Steering& steering,
           sim::RadioMedium* medium);
  LawRobot(const LawRobot&) = delete;
  LawRobot& operator=(const LawRobot&) = delete;

  /// One pass of the firmware's main loop and one millisecond of the drive.
  void Step() override;
  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t time_ns) override;

  int station() const override { return station_; }
  const sim::PlanePose& true_pose() const override { return drive_.true_pose(); }
  client::WheelSpeeds wheels() const override { return wheels_; }
  client::Counters counters() const override { return conversation().counters(); }
  int16_t p_left() const override { return conversation().state().p_left; }
  int16_t p_right() const override { return conversation().state().p_right; }
  uint8_t flags() const override { return conversation().state().flags; }
  const client::Conversation& conversation() const { return robot_.conversation(); }

 private:
  // The firmware's drive: it has the odometry, but its wheel speeds are ignored.
  struct Passenger {
    const sim::DifferentialDrive* drive = nullptr;
    bool odometry(client::Odometry* odometry) const { return drive->odometry(odometry); }
    void set_wheel_speeds(int16_t /*left_mm_s*/, int16_t /*right_mm_s*/) {}
    void emergency_stop() {}
    client::DriveStatus nothing_to_tell = client::kNothingToTell;
    const client::DriveStatus& status() const { return nothing_to_tell; }
  };

  client::WheelSpeeds Steer();

  Steering steering_;
  sim::RadioMedium* medium_;
  client::HostBoard board_;
  sim::DifferentialDrive drive_;
  Passenger passenger_;
  client::RequestMemory memory_{};
  client::Robot<client::HostBoard, Passenger> robot_;
  client::FuzzyState fuzzy_state_{client::kNoError};
  client::WheelSpeeds wheels_{0, 0};
  uint32_t answers_ = 0;
  int station_;
};

}  // namespace pheromone::swarm
