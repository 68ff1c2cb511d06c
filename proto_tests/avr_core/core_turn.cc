#include "proto_tests/avr_core/core_turn.h"

namespace pheromone {
namespace core_boundary {
namespace {

using client::Parameters;

enum : uint16_t { kStartSize = 15, kSettingSize = 3, kTurnSize = 5 };

void Append(const Bytes& bytes, uint8_t** to) {
  *(*to)++ = bytes.size();
  for (uint8_t i = 0; i < bytes.size(); ++i) {
    *(*to)++ = bytes.data()[i];
  }
}

void Append(int16_t value, uint8_t** to) {
  protocol::PutI16(*to, value);
  *to += 2;
}

// A length and so many bytes, of `size` that are there. False if they are not.
bool Take(Bytes* bytes, const uint8_t** from, uint16_t* size) {
  if (*size == 0 || **from > kMaxBytes || *size < 1u + **from) {
    return false;
  }
  const uint8_t length = *(*from)++;
  for (uint8_t i = 0; i < length; ++i) {
    bytes->Put(*(*from)++);
  }
  *size = static_cast<uint16_t>(*size - 1u - length);
  return true;
}

}  // namespace

CoreTurn::CoreTurn()
    : memory_(), drive_(&board_), robot_(&board_, &drive_, parameters_, &memory_) {}

uint16_t CoreTurn::Run(const uint8_t* request, uint16_t size, uint8_t* reply) {
  if (size > kStartSize && request[0] == kStart) {
    if (Start(request + 1, static_cast<uint16_t>(size - 1u))) {
      return 0;
    }
  } else if (size > kTurnSize && request[0] == kTurn) {
    if (Turn(request + 1, static_cast<uint16_t>(size - 1u))) {
      return Tell(reply);
    }
  }
  reply[0] = kRefused;
  return 1;
}

// As a board's main does it: everything is made anew, but for what a warm reset leaves alone.
bool CoreTurn::Start(const uint8_t* from, uint16_t size) {
  if (from[0] == 0 || !client::Restore(&memory_)) {
    memory_ = client::RequestMemory();
  }
  parameters_ = Parameters();
  parameters_.id = from[1];
  parameters_.boot_counter = protocol::GetU16(from + 2);
  parameters_.wide = from[4] != 0;
  parameters_.start.x_mm = protocol::GetI32(from + 5);
  parameters_.start.y_mm = protocol::GetI32(from + 9);
  parameters_.start.heading = protocol::GetU16(from + 13);
  for (uint16_t at = kStartSize; at < size; at = static_cast<uint16_t>(at + kSettingSize)) {
    if (size - at < kSettingSize ||
        !client::WriteSetting(from[at], protocol::GetU16(from + at + 1), &parameters_)) {
      return false;
    }
  }
  board_ = TurnBoard();
  drive_ = Drive(&board_);
  robot_ = client::Robot<TurnBoard, Drive>(&board_, &drive_, parameters_, &memory_);
  return true;
}

bool CoreTurn::Turn(const uint8_t* from, uint16_t size) {
  board_.now_ms = protocol::GetU32(from);
  board_.flags = from[4];
  Bytes* const all[] = {&board_.from_radio, &board_.from_robot, &board_.to_radio, &board_.to_robot,
                        &board_.saved};
  for (Bytes* bytes : all) {
    bytes->Clear();
  }
  from += kTurnSize;
  size = static_cast<uint16_t>(size - kTurnSize);
  if (!Take(&board_.from_radio, &from, &size) || !Take(&board_.from_robot, &from, &size) ||
      size != 0) {
    return false;
  }
  drive_.Step();
  robot_.Step();
  return true;
}

uint16_t CoreTurn::Tell(uint8_t* reply) const {
  uint8_t* to = reply;
  Append(board_.to_radio, &to);
  Append(board_.to_robot, &to);
  Append(board_.saved, &to);
  const client::Conversation& conversation = robot_.conversation();
  Append(conversation.state().wheels.left_mm_s, &to);
  Append(conversation.state().wheels.right_mm_s, &to);
  *to++ = conversation.state().flags;
  *to++ = board_.load ? 1 : 0;
  Append(conversation.state().p_left, &to);
  Append(conversation.state().p_right, &to);
  return static_cast<uint16_t>(to - reply);
}

}  // namespace core_boundary
}  // namespace pheromone
