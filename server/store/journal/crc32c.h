// CRC-32C (Castagnoli), the checksum of the journal's records: polynomial 0x1EDC6F41, reflected,
// start and final xor all ones, as in iSCSI (RFC 3720, appendix B.4). "123456789" gives 0xE3069283.
//
//   uint32_t crc = Crc32c(bytes);
//   uint32_t same = Crc32c(second_half, Crc32c(first_half));
//
// Pure; any thread. By ISA-L, with the processor's own instructions. README.md, "Figures",
// compares.
#pragma once

#include <isa-l/crc.h>

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace pheromone::journal {

/// Of what `before` is the checksum of, followed by `bytes`.
inline uint32_t Crc32c(std::string_view bytes, uint32_t before = 0) {
  constexpr size_t kMaxPiece = size_t{1} << 30;  // its length is an int
  uint32_t crc = ~before;
  while (!bytes.empty()) {
    const std::string_view piece = bytes.substr(0, kMaxPiece);
    // Not const in its declaration, but only read.
    auto* const begin = reinterpret_cast<unsigned char*>(const_cast<char*>(piece.data()));
    crc = crc32_iscsi(begin, static_cast<int>(piece.size()), crc);
    bytes.remove_prefix(piece.size());
  }
  return ~crc;
}

}  // namespace pheromone::journal
