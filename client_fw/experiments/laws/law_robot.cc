#include "client_fw/experiments/laws/law_robot.h"

#include <array>
#include <span>

namespace pheromone::swarm {
namespace {

constexpr double kStepSeconds = 0.001;

client::Parameters ParametersOf(const sim::SimulatedRobotConfig& config, const Steering& steering,
                                const sim::RadioMedium& medium) {
  client::Parameters parameters = config.client;
  parameters.start = sim::ToClientPose(config.start);
  parameters.baud = static_cast<uint32_t>(medium.baud());
  parameters.law = steering.law;
  parameters.speed_mm_s = steering.speed_mm_s;
  return parameters;
}

}  // namespace

LawRobot::LawRobot(const sim::SimulatedRobotConfig& config, const Steering& steering,
                   sim::RadioMedium* medium)
    : steering_(steering),
      medium_(medium),
      drive_(config.drive, config.start),
      passenger_{&drive_},
      robot_(&board_, &passenger_, ParametersOf(config, steering, *medium), &memory_),
      station_(medium->AddStation(this)) {}

void LawRobot::Step() {
  drive_.Advance(kStepSeconds);
  board_.set_millis(static_cast<uint32_t>(medium_->now_ns() / 1'000'000));
  board_.set_carrier(medium_->Busy(station_));
  robot_.Step();
  if (conversation().state().flags != 0) {
    fuzzy_state_ = {client::kNoError};
    wheels_ = {0, 0};
  } else if (conversation().counters().answers != answers_) {
    wheels_ = Steer();
  }
  answers_ = conversation().counters().answers;
  drive_.set_wheel_speeds(wheels_.left_mm_s, wheels_.right_mm_s);
  std::array<uint8_t, client::kMaxClientFrame> frame{};
  const size_t size = board_.TakeTransmission(frame.data(), frame.size());
  medium_->Transmit(station_, std::span(frame.data(), size));
}

client::WheelSpeeds LawRobot::Steer() {
  const int16_t left = conversation().state().p_left;
  const int16_t right = conversation().state().p_right;
  return steering_.law == client::Law::kFuzzy
             ? client::SteerFuzzy(left, right, steering_.speed_mm_s, steering_.fuzzy, &fuzzy_state_)
             : client::Steer(steering_.law, left, right, steering_.speed_mm_s, steering_.gain_8);
}

void LawRobot::OnByte(uint8_t byte, int64_t /*time_ns*/) {
  board_.Receive(byte);
}

void LawRobot::OnTransmitted(int64_t /*time_ns*/) {
  board_.OnTransmitted();
}

}  // namespace pheromone::swarm
