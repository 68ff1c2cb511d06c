// A ROUND, or the answer to a signed HELLO, that arrives although some of its bytes are damaged
// (protocol/README.md, sections 4 and 18).
//
//   size = EncodeCoded(message, wire);      // the server; FrameParser receives it
//
// Its DATA and CRC are laid out in rows of eight bytes, with one more row that is their exclusive
// or. Each row has two check bytes P and Q, as a stripe of RAID 6 has: they correct one byte of the
// row. A row with more damage is restored from the others. Bytes that follow each other belong to
// different rows, so that a burst is spread. How many bytes follow is said at the beginning, twice;
// no byte is stuffed.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "protocol/frame.h"

namespace pheromone {
namespace protocol {

/// The opcodes of the first of the two beginnings. That of the second has bit 0 as well.
constexpr uint8_t kCodedRound = 0xF4;
constexpr uint8_t kCodedHello = 0xF6;
constexpr uint8_t kCodedAgain = 0x01;

/// An ID as it is in a beginning, where no byte may be a DLE; and back.
constexpr uint8_t CodedId(uint8_t id) {
  return id == kDle ? uint8_t{0} : id;
}
constexpr uint8_t ReadCodedId(uint8_t said) {
  return said == 0 ? kDle : said;
}

/// Data bytes in a row.
constexpr uint8_t kCodedColumns = 8;
/// Rows of data; that of the largest ROUND.
constexpr uint8_t kMaxCodedRows = 8;

/// DLE STX, ID, OPCODE and the number of rows.
constexpr uint8_t kCodedLead = 5;

/// Bytes after the beginnings.
constexpr uint8_t CodedSize(uint8_t rows) {
  return static_cast<uint8_t>((kCodedColumns + 2) * (rows + 1));
}
constexpr uint8_t kMaxCoded = 2 * kCodedLead + CodedSize(kMaxCodedRows);

/// The number of rows as it is sent: the high nibble is the low one's complement.
constexpr uint8_t SayRows(uint8_t rows) {
  return static_cast<uint8_t>(rows | ((rows ^ 0x0Fu) << 4));
}
/// 0: it is not a number of rows.
constexpr uint8_t ReadRows(uint8_t said) {
  return SayRows(said & 0x0Fu) == said && (said & 0x0Fu) <= kMaxCodedRows
             ? static_cast<uint8_t>(said & 0x0Fu)
             : uint8_t{0};
}

/// Times x in GF(256) with x^8 + x^4 + x^3 + x^2 + 1.
constexpr uint8_t CodedDouble(uint8_t value) {
  return static_cast<uint8_t>((value & 0x80u) != 0 ? (value << 1) ^ 0x1D : value << 1);
}

/// Corrects what follows the beginnings, CodedSize(rows) bytes, in place: DATA comes first, then
/// its CRC. There may be more damage than can be corrected: the CRC tells.
void RepairCoded(uint8_t* bytes, uint8_t rows);

/// Rows for DATA of this length.
constexpr uint8_t CodedRows(size_t length) {
  return static_cast<uint8_t>((length + 2 + kCodedColumns - 1) / kCodedColumns);
}

/// Bytes on the wire of the coded form of a message with DATA of this length.
constexpr size_t CodedBytes(size_t length) {
  return 2u * kCodedLead + CodedSize(CodedRows(length));
}

/// Writes the coded form of a ROUND or of HELLO's answer; `wire` has room for kMaxCoded bytes.
/// Returns how many were written.
size_t EncodeCoded(const Message& message, uint8_t* wire);

}  // namespace protocol
}  // namespace pheromone
