#include "protocol/frame.h"

#include "protocol/crc16.h"

namespace pheromone {
namespace protocol {

FrameWriter::FrameWriter(uint8_t* wire) : at_(wire) {
  *at_++ = kDle;
  *at_++ = kStx;
}

void FrameWriter::Put(uint8_t byte) {
  crc_ = Crc16Update(crc_, byte);
  *at_++ = byte;
  if (byte == kDle) {
    *at_++ = kDle;
  }
}

uint8_t* FrameWriter::Finish() {
  const uint16_t crc = crc_;
  Put(static_cast<uint8_t>(crc & 0xFFu));
  Put(static_cast<uint8_t>(crc >> 8));
  *at_++ = kDle;
  *at_++ = kEtx;
  return at_;
}

uint16_t MessageCrc(const Message& message) {
  uint16_t crc = Crc16Update(0, message.id);
  crc = Crc16Update(crc, message.opcode);
  for (uint8_t i = 0; i < message.length; ++i) {
    crc = Crc16Update(crc, message.data[i]);
  }
  return crc;
}

size_t EncodeFrame(const Message& message, uint8_t* wire, size_t capacity) {
  if (message.length > kMaxData) {
    return 0;
  }
  uint8_t aside[kMaxFrame];  // for a caller whose room may be just enough
  uint8_t* const to = capacity < kMaxFrame ? aside : wire;
  FrameWriter writer(to);
  writer.Put(message.id);
  writer.Put(message.opcode);
  for (uint8_t i = 0; i < message.length; ++i) {
    writer.Put(message.data[i]);
  }
  const size_t size = static_cast<size_t>(writer.Finish() - to);
  if (size > capacity) {
    return 0;
  }
  for (size_t i = 0; capacity < kMaxFrame && i < size; ++i) {
    wire[i] = aside[i];
  }
  return size;
}

}  // namespace protocol
}  // namespace pheromone
