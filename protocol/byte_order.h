// Little-endian integers, written and read by shifts: the same bytes on every machine, whatever its
// own byte order, alignment or struct layout (wire format, section "Integers").
#pragma once

#include <stdint.h>

namespace pheromone {
namespace protocol {

inline void PutU16(uint8_t* to, uint16_t value) {
  to[0] = static_cast<uint8_t>(value & 0xFFu);
  to[1] = static_cast<uint8_t>(value >> 8);
}

inline void PutU32(uint8_t* to, uint32_t value) {
  PutU16(to, static_cast<uint16_t>(value & 0xFFFFu));
  PutU16(to + 2, static_cast<uint16_t>(value >> 16));
}

inline uint16_t GetU16(const uint8_t* from) {
  return static_cast<uint16_t>(from[0] | (static_cast<uint16_t>(from[1]) << 8));
}

inline uint32_t GetU32(const uint8_t* from) {
  return static_cast<uint32_t>(GetU16(from)) | (static_cast<uint32_t>(GetU16(from + 2)) << 16);
}

inline void PutI16(uint8_t* to, int16_t value) {
  PutU16(to, static_cast<uint16_t>(value));
}

inline void PutI32(uint8_t* to, int32_t value) {
  PutU32(to, static_cast<uint32_t>(value));
}

// Two's complement by arithmetic rather than by a narrowing cast, which C++14 leaves to the
// compiler.
inline int16_t GetI16(const uint8_t* from) {
  const uint16_t raw = GetU16(from);
  return raw < 0x8000u ? static_cast<int16_t>(raw)
                       : static_cast<int16_t>(-static_cast<int16_t>(0xFFFFu - raw) - 1);
}

inline int32_t GetI32(const uint8_t* from) {
  const uint32_t raw = GetU32(from);
  return raw < 0x80000000u ? static_cast<int32_t>(raw)
                           : -static_cast<int32_t>(0xFFFFFFFFu - raw) - 1;
}

}  // namespace protocol
}  // namespace pheromone
