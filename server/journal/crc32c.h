// CRC-32C (Castagnoli), the checksum of the journal's records: polynomial 0x1EDC6F41, reflected,
// start and final xor all ones, as in iSCSI (RFC 3720, appendix B.4). "123456789" gives 0xE3069283.
//
//   uint32_t crc = Crc32c(bytes);
//   uint32_t same = Crc32c(second_half, Crc32c(first_half));
//
// Pure; any thread. Slicing by eight (Kounavis and Berry 2005), without special instructions: about
// a byte a cycle, far more than a disk takes.
#pragma once

#include <cstdint>
#include <string_view>

namespace pheromone::journal {

/// Of what `before` is the checksum of, followed by `bytes`.
uint32_t Crc32c(std::string_view bytes, uint32_t before = 0);

}  // namespace pheromone::journal
