#include "client_fw/sim/simulated_robot.h"

#include <array>
#include <span>

namespace pheromone::sim {
namespace {

constexpr double kStepSeconds = 0.001;

client::Parameters ParametersFor(client::Parameters parameters, const PlanePose& start,
                                 const RadioMedium& medium) {
  parameters.start = ToClientPose(start);
  parameters.baud = static_cast<uint32_t>(medium.baud());
  return parameters;
}

}  // namespace

SimulatedRobot::SimulatedRobot(const SimulatedRobotConfig& config, RadioMedium* medium)
    : medium_(medium),
      power_on_ns_(config.power_on_ms * 1'000'000),
      power_off_ms_(config.power_off_ms),
      drive_(config.drive, config.start),
      robot_(&board_, &drive_, ParametersFor(config.client, config.start, *medium), &memory_,
             SimulatedTask(config, config.client, &net_memory_)),
      station_(medium->AddStation(this, config.turnaround_ns)) {}

void SimulatedRobot::Step() {
  if (!powered()) {
    return;
  }
  drive_.Advance(kStepSeconds);
  bumps_.Look(drive_.stalled(), drive_.true_pose());
  if (sent_at_ns_ <= medium_->now_ns()) {
    sent_at_ns_ = RadioMedium::kNever;
    board_.OnTransmitted();
  }
  board_.set_millis(static_cast<uint32_t>(medium_->now_ns() / 1'000'000));
  board_.set_carrier(medium_->Busy(station_));
  robot_.Step();
  std::array<uint8_t, client::kMaxClientFrame> frame{};
  const size_t size = board_.TakeTransmission(frame.data(), frame.size());
  medium_->Transmit(station_, std::span(frame.data(), size));
  if (size != 0) {
    sent_at_ns_ = medium_->now_ns() + static_cast<int64_t>(size) * medium_->byte_ns();
  }
}

void SimulatedRobot::OnByte(uint8_t byte, int64_t /*time_ns*/) {
  if (powered()) {
    board_.Receive(byte);
  }
}

}  // namespace pheromone::sim
