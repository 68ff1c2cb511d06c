// One robot of a simulation that drives a Pioneer: the client's real code on a host board, ARCOS
// client included, a cable, a simulated Pioneer at its other end, and a modem on a radio medium.
//
//   HostPioneerRobotConfig config;
//   config.pioneer.model = *FindPioneerModel("p3dx-sh");
//   HostPioneerRobot robot(config, &medium);
//   medium.AdvanceTo(...); robot.Step();                       // every millisecond
//
// It is like AvrRobot, with the same code compiled for the host: tens of times faster, and with
// counters. Step() is one pass of the firmware's main loop. The client's start pose is the true
// one, rounded; the Pioneer counts from zero wherever it is. One thread.
#pragma once

#include <cstdint>
#include <optional>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/core/pioneer/pioneer_drive.h"
#include "client_fw/core/robot.h"
#include "client_fw/sim/bump_counter.h"
#include "client_fw/sim/mobile_robot.h"
#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/sim/released.h"
#include "client_fw/sim/serial_line.h"
#include "client_fw/sim/simulated_task.h"

namespace pheromone::sim {

struct HostPioneerRobotConfig : SimulatedTaskConfig {
  client::Parameters client = ReleasedParameters();  ///< `start` and `baud` are overwritten
  PioneerConfig pioneer;
  PlanePose start;
  int64_t cable_baud = 9600;
  std::optional<int64_t> turnaround_ns;  ///< of its modem, if not the medium's
};

class HostPioneerRobot final : public MobileRobot {
 public:
  /// `medium` must outlive the robot, and the robot must outlive the medium's last event.
  HostPioneerRobot(const HostPioneerRobotConfig& config, RadioMedium* medium);
  HostPioneerRobot(const HostPioneerRobot&) = delete;
  HostPioneerRobot& operator=(const HostPioneerRobot&) = delete;

  void Step() override;
  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t time_ns) override;

  int station() const override { return station_; }
  const PlanePose& true_pose() const override { return pioneer_.drive().true_pose(); }
  client::WheelSpeeds wheels() const override { return robot_.wheels(); }
  client::Counters counters() const override { return robot_.conversation().counters(); }
  int16_t p_left() const override { return robot_.conversation().state().p_left; }
  int16_t p_right() const override { return robot_.conversation().state().p_right; }
  uint8_t flags() const override { return robot_.conversation().state().flags; }
  uint32_t bumps() const override { return bumps_.count(); }
  bool HoldsLoad() const override { return board_.load(); }
  const client::Cleaner* cleaner() const override { return robot_.task().cleaner(); }
  const client::Forager* forager() const override { return robot_.task().forager(); }

  const PioneerRobot& pioneer() const { return pioneer_; }

 private:
  // A host board with a second UART.
  class Board : public client::HostBoard {
   public:
    explicit Board(int64_t cable_baud) : commands(cable_baud), reports(cable_baud) {}
    int robot_get() {
      const auto arrived = reports.Get(now_ns);
      return arrived ? arrived->byte : -1;
    }
    bool robot_put(uint8_t byte) {
      commands.Put(byte, now_ns);
      return true;
    }
    static void set_robot_rate(uint8_t /*number*/) {}

    SerialLine commands;  // to the Pioneer
    SerialLine reports;   // from it
    int64_t now_ns = 0;
  };

  void StepPioneer();

  RadioMedium* medium_;
  Board board_;
  PioneerRobot pioneer_;
  BumpCounter bumps_;
  client::PioneerDrive<Board> drive_;
  client::RequestMemory memory_{};
  client::NetMemory net_memory_{};
  client::Robot<Board, client::PioneerDrive<Board>, SimulatedTask> robot_;
  int station_;
};

}  // namespace pheromone::sim
