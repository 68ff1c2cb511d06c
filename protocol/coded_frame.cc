#include "protocol/coded_frame.h"

#include "protocol/opcodes.h"

namespace pheromone {
namespace protocol {

size_t EncodeCoded(const Message& message, uint8_t* wire) {
  const uint8_t rows = CodedRows(message.length);
  const uint8_t opcode = message.opcode == kRound ? kCodedRound : kCodedHello;
  uint8_t* at = wire;
  for (uint8_t i = 0; i < 2; ++i) {
    const uint8_t beginning[kCodedLead] = {kDle, kStx, CodedId(message.id),
                                           static_cast<uint8_t>(opcode | i * kCodedAgain),
                                           SayRows(rows)};
    for (const uint8_t byte : beginning) {
      *at++ = byte;
    }
  }
  uint8_t* const data = at;
  for (size_t i = 0; i < CodedSize(rows); ++i) {
    data[i] = i < message.length ? message.data[i] : uint8_t{0};
  }
  const uint16_t crc = MessageCrc(message);
  data[message.length] = static_cast<uint8_t>(crc & 0xFFu);
  data[message.length + 1] = static_cast<uint8_t>(crc >> 8);
  uint8_t* const sum = data + static_cast<uint8_t>(kCodedColumns * rows);
  for (uint8_t i = 0; i < kCodedColumns * rows; ++i) {
    sum[i / rows] ^= data[i];
  }
  uint8_t* const p = sum + kCodedColumns;
  uint8_t* const q = p + rows + 1;
  for (uint8_t row = 0; row <= rows; ++row) {
    for (uint8_t column = kCodedColumns; column-- != 0;) {
      const uint8_t byte = row < rows ? data[column * rows + row] : sum[column];
      p[row] ^= byte;
      q[row] = static_cast<uint8_t>(CodedDouble(q[row]) ^ byte);
    }
  }
  return static_cast<size_t>(q + rows + 1 - wire);
}

}  // namespace protocol
}  // namespace pheromone
