#include "proto_tests/attacked_channel/observer.h"

#include <algorithm>
#include <cmath>

namespace pheromone::attack {
namespace {

constexpr double kCellMm = 100;
// Section 18: what a client's frame has behind DATA.
constexpr uint8_t kSignatureBytes = 5;

}  // namespace

Node NodeNear(int64_t x_mm, int64_t y_mm) {
  const auto nearest = [](int64_t mm) {  // a tie goes to the larger coordinate
    return static_cast<int>(std::floor(static_cast<double>(mm) / kCellMm + 0.5));
  };
  return {nearest(x_mm), nearest(y_mm)};
}

void Observer::OnByte(uint8_t byte, int64_t time_ns) {
  if (decoder_.Push(byte, static_cast<uint32_t>(time_ns / 1'000'000))) {
    OnFrame(decoder_.message());
  }
}

void Observer::OnFrame(protocol::Message message) {
  if (message.opcode == protocol::kHello) {
    said_hello_ = true;
    return;
  }
  if (is_signed_) {
    message.length = static_cast<uint8_t>(std::max(0, message.length - kSignatureBytes));
  }
  protocol::CommandAck ack;
  if (Decode(message, &ack)) {
    if (acks_.empty() || acks_.back().seq != ack.seq || acks_.back().code != ack.code) {
      acks_.push_back(ack);
    }
  } else if (protocol::IsMutating(message.opcode)) {
    OnChange(message);
  }
}

void Observer::OnChange(const protocol::Message& message) {
  const bool repeats = last_ && last_->opcode == message.opcode &&
                       last_->length == message.length &&
                       std::equal(last_->data, last_->data + last_->length, message.data);
  if (!repeats) {
    if (last_ && node_ && !said_hello_ &&
        message.data[0] == static_cast<uint8_t>(last_->data[0] + 1)) {  // seq is the first field
      ++changes_[*node_].acknowledged;
    }
    node_.reset();
    protocol::TraceRequest trace;
    if (Decode(message, &trace)) {
      node_ = NodeNear(trace.pose.x, trace.pose.y);
      ++changes_[*node_].made;
    }
    last_ = message;
  }
  said_hello_ = false;
}

}  // namespace pheromone::attack
