#include "protocol/coded_round.h"

namespace pheromone {
namespace protocol {

size_t EncodeCodedRound(const Message& round, uint8_t* wire) {
  const size_t size = round.length + 2u;
  const uint8_t rows = static_cast<uint8_t>((size + kCodedColumns - 1) / kCodedColumns);
  uint8_t* at = wire;
  for (uint8_t i = 0; i < 2; ++i) {
    const uint8_t beginning[kCodedLead] = {kDle, kStx, round.id,
                                           i == 0 ? kCodedRound : kCodedRoundAgain, SayRows(rows)};
    for (const uint8_t byte : beginning) {
      *at++ = byte;
    }
  }
  uint8_t* const data = at;
  for (size_t i = 0; i < CodedSize(rows); ++i) {
    data[i] = i < round.length ? round.data[i] : uint8_t{0};
  }
  const uint16_t crc = MessageCrc(round);
  data[round.length] = static_cast<uint8_t>(crc & 0xFFu);
  data[round.length + 1] = static_cast<uint8_t>(crc >> 8);
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
