// A server's answer to HELLO, for robots in QEMU.
#pragma once

#include "protocol/frame.h"
#include "protocol/messages.h"

namespace pheromone {

inline protocol::Message HelloAnswerTo(const protocol::HelloRequest& hello) {
  protocol::HelloAnswer answer;
  answer.id = hello.id;
  answer.nonce = hello.nonce;
  answer.protocol_version = protocol::kProtocolVersion;
  answer.epoch = 7;
  answer.pose_unit_10um = 100;  // 1 mm
  answer.type_mask = 1u << 1;
  answer.slot_ms = 2;
  answer.response_window_ms = 250;
  protocol::Message message;
  protocol::Encode(answer, &message);
  return message;
}

}  // namespace pheromone
