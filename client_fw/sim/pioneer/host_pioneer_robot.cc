#include "client_fw/sim/pioneer/host_pioneer_robot.h"

#include <array>
#include <span>

namespace pheromone::sim {
namespace {

client::Parameters ParametersFor(client::Parameters parameters, const PlanePose& start,
                                 const RadioMedium& medium) {
  parameters.start = ToClientPose(start);
  parameters.baud = static_cast<uint32_t>(medium.baud());
  return parameters;
}

}  // namespace

HostPioneerRobot::HostPioneerRobot(const HostPioneerRobotConfig& config, RadioMedium* medium)
    : medium_(medium),
      board_(config.cable_baud),
      pioneer_(config.pioneer, config.start),
      drive_(&board_, static_cast<int16_t>(config.client.drive_scale), config.client.sonar),
      robot_(&board_, &drive_, ParametersFor(config.client, config.start, *medium), &memory_,
             SimulatedTask(config, config.client, &net_memory_)),
      station_(medium->AddStation(this, config.turnaround_ns)) {}

void HostPioneerRobot::Step() {
  board_.now_ns = medium_->now_ns();
  board_.set_millis(static_cast<uint32_t>(medium_->now_ns() / 1'000'000));
  board_.set_carrier(medium_->Busy(station_));
  StepPioneer();
  drive_.Step();
  robot_.Step();
  std::array<uint8_t, client::kMaxClientFrame> frame{};
  const size_t size = board_.TakeTransmission(frame.data(), frame.size());
  medium_->Transmit(station_, std::span(frame.data(), size));
}

void HostPioneerRobot::StepPioneer() {
  while (const auto command = board_.commands.Get(board_.now_ns)) {
    pioneer_.OnBytes({&command->byte, 1}, command->time_ns);
  }
  pioneer_.AdvanceTo(board_.now_ns);
  for (const uint8_t byte : pioneer_.TakeOutput()) {
    board_.reports.Put(byte, board_.now_ns);
  }
  bumps_.Look(pioneer_.drive().stalled(), pioneer_.drive().true_pose());
}

void HostPioneerRobot::OnByte(uint8_t byte, int64_t /*time_ns*/) {
  board_.Receive(byte);
}

void HostPioneerRobot::OnTransmitted(int64_t /*time_ns*/) {
  board_.OnTransmitted();
}

}  // namespace pheromone::sim
