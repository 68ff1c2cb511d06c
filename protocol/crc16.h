// CRC-16/ARC, the check of every frame: polynomial x16 + x15 + x2 + 1, bits reflected (0xA001),
// start value 0, no final exclusive or. "123456789" gives 0xBB3D. The polynomial is DF1's; what it
// covers is not (see protocol/README.md).
//
//   uint16_t crc = 0;
//   for (each byte of ID, OPCODE, DATA) crc = Crc16Update(crc, byte);
//
// A body followed by its own CRC, low byte first, leaves 0. So does a body of zero bytes, which is
// why ID 0 and opcode 0 are never valid.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace pheromone {
namespace protocol {

/// The CRC of what came before, `crc`, followed by `byte`.
uint16_t Crc16Update(uint16_t crc, uint8_t byte);

/// The CRC of `size` bytes.
uint16_t Crc16(const uint8_t* bytes, size_t size);

/// What a piece of memory is kept with: the complement of its CRC. (Memory full of zeros would pass
/// the plain one.)
uint16_t Check(const void* memory, size_t size);

}  // namespace protocol
}  // namespace pheromone
