#include "client_fw/experiments/bridge/robot.h"

#include <cmath>

namespace pheromone::swarm {

BridgeDrive::BridgeDrive(const BridgeRobotConfig& config, const BridgeArena* arena)
    : wandering_(config.wandering),
      wheelbase_m_(config.wheelbase_m),
      turn_s_(config.turn_s),
      guide_(arena),
      pose_(guide_.Start()),
      random_(config.seed) {}

BridgeGuide::Step BridgeDrive::Advance(double seconds, bool short_open) {
  if (standing_s_ > 0) {
    standing_s_ -= seconds;
    if (standing_s_ <= 0) {
      guide_.Turn(&pose_);
    }
    return BridgeGuide::Step::kNone;
  }
  const bool driving = left_m_s_ != 0 || right_m_s_ != 0;
  const double sway_m_s = driving ? Wander(seconds) * wheelbase_m_ / 2 : 0;
  pose_ = sim::MoveOnArc(pose_, (left_m_s_ - sway_m_s) * seconds, (right_m_s_ + sway_m_s) * seconds,
                         wheelbase_m_);
  const BridgeGuide::Step event = guide_.Hold(&pose_, short_open);
  if (event == BridgeGuide::Step::kArrived) {
    standing_s_ = turn_s_;
  }
  return event;
}

// One step of the Ornstein-Uhlenbeck process, exact in mean, variance and correlation. Each step's
// random number is uniformly distributed; their sum over the process's memory is nearly normal, and
// the same with every standard library.
double BridgeDrive::Wander(double seconds) {
  const double kept = std::exp(-seconds / wandering_.memory_s);
  const double even = static_cast<double>(random_() >> 11) * 0x1p-52 - 1;  // variance 1/3
  wander_rad_s_ = kept * wander_rad_s_ + wandering_.rad_s * std::sqrt(3 * (1 - kept * kept)) * even;
  return wander_rad_s_;
}

bool BridgeDrive::odometry(client::Odometry* odometry) const {
  *odometry = sim::ToClientPose(pose_);
  return true;
}

void BridgeDrive::set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
  left_m_s_ = left_mm_s / 1000.0;
  right_m_s_ = right_mm_s / 1000.0;
}

BridgeRobot::BridgeRobot(const BridgeRobotConfig& config, const BridgeArena* arena)
    : drive_(config, arena), robot_(&board_, &drive_, config.client, &memory_) {}

void BridgeRobot::Step(int64_t now_ms, bool carrier) {
  board_.set_millis(static_cast<uint32_t>(now_ms));
  board_.set_carrier(carrier);
  robot_.Step();
}

size_t BridgeRobot::TakeTransmission(std::span<uint8_t> frame) {
  return board_.TakeTransmission(frame.data(), frame.size());
}

void BridgeRobot::OnByte(uint8_t byte, int64_t /*time_ns*/) {
  board_.Receive(byte);
}

void BridgeRobot::OnTransmitted(int64_t /*time_ns*/) {
  board_.OnTransmitted();
}

}  // namespace pheromone::swarm
