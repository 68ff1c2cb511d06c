#include "protocol/crc16.h"

#include "protocol/signing.h"

#if defined(__AVR__) && PHEROMONE_SIGNING
#include <util/crc16.h>
#endif

namespace pheromone {
namespace protocol {

#if defined(__AVR__) && PHEROMONE_SIGNING

// In a quarter of the time of what is below, so that after a coded ROUND is still time for its tag.
uint16_t Crc16Update(uint16_t crc, uint8_t byte) {
  return _crc16_update(crc, byte);
}

#elif defined(__AVR__)

// Bit by bit, as it is defined: a third of the size of what is below, and still a hundred times
// faster than the radio.
uint16_t Crc16Update(uint16_t crc, uint8_t byte) {
  crc ^= byte;
  for (uint8_t bit = 0; bit < 8; ++bit) {
    const bool odd = (crc & 1u) != 0;
    crc >>= 1;
    if (odd) {
      crc ^= 0xA001u;
    }
  }
  return crc;
}

#else

// One byte at once without a table: a table of 512 bytes would cost a microcontroller half of its
// memory, and the loop over bits is four times slower. Eight steps of the reflected register
// collapse into the parity of the low byte and two shifted copies of it.
uint16_t Crc16Update(uint16_t crc, uint8_t byte) {
  const uint8_t low = static_cast<uint8_t>((crc ^ byte) & 0xFFu);
  const uint8_t folded = static_cast<uint8_t>(low ^ (low >> 4));
  const bool odd = ((0x6996u >> (folded & 0x0Fu)) & 1u) != 0;
  const uint16_t copy = low;
  uint16_t next = static_cast<uint16_t>(crc >> 8);
  next = static_cast<uint16_t>(next ^ static_cast<uint16_t>(copy << 6) ^
                               static_cast<uint16_t>(copy << 7));
  return odd ? static_cast<uint16_t>(next ^ 0xC001u) : next;
}

#endif

uint16_t Crc16(const uint8_t* bytes, size_t size) {
  uint16_t crc = 0;
  for (size_t i = 0; i < size; ++i) {
    crc = Crc16Update(crc, bytes[i]);
  }
  return crc;
}

uint16_t Check(const void* memory, size_t size) {
  return static_cast<uint16_t>(~Crc16(static_cast<const uint8_t*>(memory), size));
}

}  // namespace protocol
}  // namespace pheromone
