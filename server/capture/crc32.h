// CRC-32 as in Ethernet, PNG and pcapng's epb_hash: polynomial 0x04C11DB7 reflected, start and
// final xor all ones. "123456789" gives 0xCBF43926. Finds damage; no protection against forgery.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace pheromone::capture {

inline uint32_t Crc32(std::string_view bytes) {
  static constexpr std::array<uint32_t, 256> kTable = [] {
    std::array<uint32_t, 256> table{};
    for (uint32_t i = 0; i < 256; ++i) {
      uint32_t value = i;
      for (int bit = 0; bit < 8; ++bit) {
        value = (value >> 1) ^ ((value & 1) != 0 ? 0xEDB88320u : 0u);
      }
      table[i] = value;
    }
    return table;
  }();
  uint32_t crc = 0xFFFFFFFF;
  for (const char c : bytes) {
    crc = (crc >> 8) ^ kTable[(crc ^ static_cast<unsigned char>(c)) & 0xFF];
  }
  return ~crc;
}

}  // namespace pheromone::capture
