// CRC-32 as in Ethernet, PNG and pcapng's epb_hash: polynomial 0x04C11DB7 reflected, start and
// final xor all ones. "123456789" gives 0xCBF43926. Finds damage; no protection against forgery.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string_view>

namespace pheromone::capture {

inline uint32_t Crc32(std::string_view bytes) {
  return static_cast<uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace pheromone::capture
