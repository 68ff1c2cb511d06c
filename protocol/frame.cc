#include "protocol/frame.h"

#include "protocol/crc16.h"

namespace pheromone {
namespace protocol {
namespace {

// Appends bytes to a caller's array and remembers whether one did not fit.
class Writer {
 public:
  Writer(uint8_t* to, size_t capacity) : to_(to), capacity_(capacity) {}

  void Raw(uint8_t byte) {
    if (size_ < capacity_) {
      to_[size_] = byte;
    }
    ++size_;
  }

  void Stuffed(uint8_t byte) {
    Raw(byte);
    if (byte == kDle) {
      Raw(kDle);
    }
  }

  size_t size() const { return size_ <= capacity_ ? size_ : 0; }

 private:
  uint8_t* to_;
  size_t capacity_;
  size_t size_ = 0;
};

}  // namespace

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
  Writer writer(wire, capacity);
  writer.Raw(kDle);
  writer.Raw(kStx);
  writer.Stuffed(message.id);
  writer.Stuffed(message.opcode);
  for (uint8_t i = 0; i < message.length; ++i) {
    writer.Stuffed(message.data[i]);
  }
  const uint16_t crc = MessageCrc(message);
  writer.Stuffed(static_cast<uint8_t>(crc & 0xFFu));
  writer.Stuffed(static_cast<uint8_t>(crc >> 8));
  writer.Raw(kDle);
  writer.Raw(kEtx);
  return writer.size();
}

}  // namespace protocol
}  // namespace pheromone
