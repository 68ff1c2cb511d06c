#include "client_fw/lab/firmware/firmware_robot.h"

#include "protocol/frame.h"

namespace pheromone::lab {

FirmwareRobot::FirmwareRobot(const client::Parameters& parameters)
    : robot_(&board_, &drive_, parameters, &memory_), decoder_(protocol::kNoGapTimeout) {}

void FirmwareRobot::Hear(const protocol::Message& message) {
  const size_t before = board_.heard_.size();
  board_.heard_.resize(before + protocol::kMaxFrame);
  const size_t size =
      protocol::EncodeFrame(message, board_.heard_.data() + before, protocol::kMaxFrame);
  board_.heard_.resize(before + size);
}

const protocol::Message* FirmwareRobot::Step(client::Moment now_ms) {
  board_.now_ms_ = now_ms;
  robot_.Step();
  board_.heard_.clear();
  board_.read_ = 0;
  const protocol::Message* sent = nullptr;
  for (size_t i = 0; i < board_.size_; ++i) {
    if (decoder_.Push(board_.sent_[i], now_ms)) {
      sent = &decoder_.message();
    }
  }
  board_.size_ = 0;
  return sent;
}

}  // namespace pheromone::lab
