// One robot of a simulation: the client's real code on a host board, a differential drive, and a
// modem on a radio medium.
//
//   RadioMedium medium(radio);
//   SimulatedRobot robot(config, &medium);
//   for (int64_t ms = 1; ms <= end_ms; ++ms) {
//     medium.AdvanceTo(ms * 1'000'000);
//     robot.Step();
//   }
//
// Step() is one turn of the firmware's main loop and one millisecond of the drive, at the medium's
// present time. The start pose told to the client is the true one, rounded. One thread.
#pragma once

#include <cstdint>
#include <optional>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/core/robot.h"
#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/radio_medium.h"

namespace pheromone::sim {

struct SimulatedRobotConfig {
  client::Parameters client;  ///< `start` is overwritten
  DriveConfig drive;
  PlanePose start;
  int64_t power_on_ms = 0;               ///< until then it neither hears nor does anything
  std::optional<int64_t> turnaround_ns;  ///< of its modem, if not the medium's
};

class SimulatedRobot : public Station {
 public:
  /// `medium` must outlive the robot, and the robot must outlive the medium's last event.
  SimulatedRobot(const SimulatedRobotConfig& config, RadioMedium* medium);
  SimulatedRobot(const SimulatedRobot&) = delete;
  SimulatedRobot& operator=(const SimulatedRobot&) = delete;

  void Step();

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t time_ns) override;

  const PlanePose& true_pose() const { return drive_.true_pose(); }
  const DifferentialDrive& drive() const { return drive_; }
  /// What the client told the drive last.
  client::WheelSpeeds wheels() const { return robot_.wheels(); }
  /// Counters, flags, last P_L and P_R, the server's HELLO.
  const client::Conversation& conversation() const { return robot_.conversation(); }
  int station() const { return station_; }

 private:
  bool powered() const { return medium_->now_ns() >= power_on_ns_; }

  RadioMedium* medium_;
  int64_t power_on_ns_;
  client::HostBoard board_;
  DifferentialDrive drive_;
  client::RequestMemory memory_{};
  client::Robot<client::HostBoard, DifferentialDrive> robot_;
  int station_;
};

}  // namespace pheromone::sim
