#include "client_fw/attach/attached_robot.h"

#include <array>

namespace pheromone::attach {
namespace {

bool Same(const client::Odometry& a, const client::Odometry& b) {
  return a.x_mm == b.x_mm && a.y_mm == b.y_mm && a.heading == b.heading;
}

}  // namespace

AttachedRobot::AttachedRobot(const client::Parameters& parameters)
    : drive_(&board_, static_cast<int16_t>(parameters.drive_scale), parameters.sonar),
      robot_(&board_, &drive_, parameters, &memory_) {}

void AttachedRobot::OnRobotBytes(std::span<const uint8_t> bytes) {
  for (const uint8_t byte : bytes) {
    board_.reports.Put(byte);  // bytes that do not fit are lost, as on a UART
  }
}

void AttachedRobot::OnRobotConnected(uint32_t now_ms, bool close_first) {
  board_.set_millis(now_ms);
  board_.reports = {};
  board_.commands = {};
  drive_.Restart(close_first);
}

void AttachedRobot::OnModemBytes(std::span<const uint8_t> bytes) {
  from_modem_.insert(from_modem_.end(), bytes.begin(), bytes.end());
}

void AttachedRobot::Step(uint32_t now_ms) {
  if (left()) {
    return;
  }
  board_.set_millis(now_ms);
  drive_.Step();
  WatchPose();
  if (leaving_ != Leaving::kNo) {
    StepLeaving(now_ms);
    return;
  }
  if (now_ms - last_step_ms_ > kPauseMs) {
    from_modem_.clear();
  }
  last_step_ms_ = now_ms;
  board_.Receive(from_modem_.data(), from_modem_.size());
  from_modem_.clear();
  robot_.Step();
}

std::vector<uint8_t> AttachedRobot::TakeCommands() {
  std::vector<uint8_t> bytes;
  for (int byte = board_.commands.Get(); byte >= 0; byte = board_.commands.Get()) {
    bytes.push_back(static_cast<uint8_t>(byte));
  }
  return bytes;
}

std::vector<uint8_t> AttachedRobot::TakeFrame() {
  std::array<uint8_t, client::kMaxClientFrame> frame{};
  const size_t size = board_.TakeTransmission(frame.data(), frame.size());
  return {frame.begin(), frame.begin() + static_cast<ptrdiff_t>(size)};
}

void AttachedRobot::Leave() {
  if (leaving_ != Leaving::kNo) {
    return;
  }
  leaving_ = Leaving::kStopping;
  leave_ms_ = board_.millis();
  equal_poses_ = 0;
  drive_.set_wheel_speeds(0, 0);  // repeated by the link to the Pioneer
}

void AttachedRobot::WatchPose() {
  const client::Pioneer& pioneer = drive_.pioneer();
  if (!pioneer.known()) {
    equal_poses_ = -1;  // the first report of a session tells no motion
  } else if (sips_ != pioneer.sips()) {
    sips_ = pioneer.sips();
    equal_poses_ = Same(odometry_, pioneer.odometry()) ? equal_poses_ + 1 : 0;
    odometry_ = pioneer.odometry();
  }
}

void AttachedRobot::StepLeaving(uint32_t now_ms) {
  if (drive_.pioneer().known() && !stands() && now_ms - leave_ms_ < kLongestStopMs) {
    return;
  }
  // Without a session too: a robot that does not reach us may hear us.
  std::array<uint8_t, client::kMaxPioneerCommand> close{};
  const uint8_t size = client::EncodeCommand(client::PioneerCommand::kClose, close.data());
  for (uint8_t i = 0; i < size; ++i) {
    board_.commands.Put(close[i]);
  }
  leaving_ = Leaving::kLeft;
}

client::Pose AttachedRobot::pose() const {
  return client::StartPose(robot_.conversation().state().parameters.start)
      .Place(drive_.pioneer().odometry());
}

}  // namespace pheromone::attach
