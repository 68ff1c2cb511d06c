// Frames of a client, and of servers that answer it, for tests.
#pragma once

#include <stdint.h>

#include "client_fw/core/testing/frames.h"
#include "protocol/messages.h"

namespace pheromone::client {

inline constexpr uint16_t kTestNonce = 0x1234;

inline Bytes Sense(int16_t x) {
  return FrameOf(protocol::SenseRequest{kTestId, 1, false, {x, 0, 0}});
}
inline Bytes Sensed(uint8_t id = kTestId) {
  return FrameOf(protocol::SenseAnswer{id, 1, false, 5, 5});
}
inline Bytes Trace(uint8_t seq) {
  return FrameOf(protocol::TraceRequest{kTestId, 1, false, seq, {0, 0, 0}});
}
inline Bytes Traced(uint8_t seq) {
  return FrameOf(protocol::TraceAnswer{kTestId, 1, false, seq, 5, 5});
}
inline Bytes Refusal(uint8_t seq, protocol::Reason reason) {
  return FrameOf(protocol::ErrorAnswer{kTestId, protocol::kTrace | 1, reason, seq});
}
inline Bytes Hello() {
  return FrameOf(protocol::HelloRequest{kTestId, kTestNonce, 1, 0});
}
inline Bytes Greeting(uint16_t epoch, uint16_t nonce = kTestNonce) {
  return FrameOf(GreetingOf(kTestId, nonce, epoch));
}

}  // namespace pheromone::client
