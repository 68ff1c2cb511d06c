// Frames of clients and servers that tests play, and the answer to HELLO.
#pragma once

#include <stdint.h>

#include <vector>

#include "protocol/frame.h"
#include "protocol/messages.h"

namespace pheromone {
namespace client {

using Bytes = std::vector<uint8_t>;

constexpr uint8_t kTestId = 7;

inline Bytes FrameOf(const protocol::Message& message) {
  uint8_t frame[protocol::kMaxFrame];
  return Bytes(frame, frame + protocol::EncodeFrame(message, frame, sizeof(frame)));
}

template <class T>
Bytes FrameOf(const T& what) {
  protocol::Message message;
  Encode(what, &message);
  return FrameOf(message);
}

/// Of a server that has pheromone 1, and poses in mm.
inline protocol::HelloAnswer GreetingOf(uint8_t id, uint16_t nonce, uint16_t epoch) {
  protocol::HelloAnswer greeting;
  greeting.id = id;
  greeting.nonce = nonce;
  greeting.protocol_version = protocol::kProtocolVersion;
  greeting.epoch = epoch;
  greeting.pose_unit_10um = 100;
  greeting.antenna_distance_mm = 200;
  greeting.type_mask = 0x0002;
  return greeting;
}

}  // namespace client
}  // namespace pheromone
