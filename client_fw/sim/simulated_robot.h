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
// present time. The client's start pose is the true one, rounded. One thread.
#pragma once

#include <cstdint>
#include <optional>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/core/robot.h"
#include "client_fw/sim/bump_counter.h"
#include "client_fw/sim/differential_drive.h"
#include "client_fw/sim/mobile_robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/sim/released.h"
#include "client_fw/sim/simulated_task.h"

namespace pheromone::sim {

struct SimulatedRobotConfig : SimulatedTaskConfig {
  client::Parameters client = ReleasedParameters();  ///< `start` and `baud` are overwritten
  DriveConfig drive;
  PlanePose start;
  int64_t power_on_ms = 0;               ///< until then it neither hears nor does anything
  int64_t power_off_ms = INT64_MAX;      ///< from then on: where it is, it stays
  std::optional<int64_t> turnaround_ns;  ///< of its modem, if not the medium's
};

class SimulatedRobot final : public MobileRobot {
 public:
  /// `medium` must outlive the robot, and the robot must outlive the medium's last event.
  SimulatedRobot(const SimulatedRobotConfig& config, RadioMedium* medium);
  SimulatedRobot(const SimulatedRobot&) = delete;
  SimulatedRobot& operator=(const SimulatedRobot&) = delete;

  void Step() override;
  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t /*time_ns*/) override {}

  int station() const override { return station_; }
  const PlanePose& true_pose() const override { return drive_.true_pose(); }
  client::WheelSpeeds wheels() const override { return robot_.wheels(); }
  client::Counters counters() const override { return conversation().counters(); }
  int16_t p_left() const override { return conversation().state().p_left; }
  int16_t p_right() const override { return conversation().state().p_right; }
  uint8_t flags() const override { return conversation().state().flags; }
  uint32_t bumps() const override { return bumps_.count(); }
  bool HoldsLoad() const override { return powered() && board_.load(); }
  const client::Cleaner* cleaner() const override {
    return powered() ? robot_.task().cleaner() : nullptr;
  }
  const client::Forager* forager() const override {
    return powered() ? robot_.task().forager() : nullptr;
  }

  const DifferentialDrive& drive() const { return drive_; }
  /// The rest of what the client knows, such as the server's HELLO.
  const client::Conversation& conversation() const { return robot_.conversation(); }

 private:
  bool powered() const {
    return medium_->now_ns() >= power_on_ns_ && medium_->now_ns() / 1'000'000 < power_off_ms_;
  }

  RadioMedium* medium_;
  int64_t power_on_ns_;
  int64_t power_off_ms_;
  client::HostBoard board_;
  DifferentialDrive drive_;
  BumpCounter bumps_;
  client::RequestMemory memory_{};
  client::NetMemory net_memory_{};
  client::Robot<client::HostBoard, DifferentialDrive, SimulatedTask> robot_;
  int station_;
  int64_t sent_at_ns_ = RadioMedium::kNever;  // the UART is empty; the modem is a turnaround later
};

}  // namespace pheromone::sim
