// Encodes records as blocks of a pcapng file and decodes them (README.md has the layout).
//
//   std::string file = EncodeFileHeader(links);
//   file += EncodeRecord(start, 1);
//   file += EncodeRecord(packet, 2);
//
// Packets are stored as "Enhanced Packet Blocks", which every pcapng reader knows; everything else
// is in blocks for local use, which other readers skip. Pure; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"
#include "server/store/capture/record.h"

namespace pheromone::capture {

/// The version of files, which their Start says.
constexpr uint8_t kFormatVersion = 1;

/// No block is longer: Wireshark refuses a file with a block beyond 16 MiB.
constexpr uint32_t kMaxBlock = 8u << 20;
/// Of the blocks before the first record: one for each link.
constexpr uint32_t kMaxFileHeader = 1u << 20;
/// The maximum payload of a block.
constexpr size_t kStatePortion = 1u << 20;

constexpr uint32_t kSectionHeader = 0x0A0D0D0A;
constexpr uint32_t kInterface = 1;
constexpr uint32_t kEnhancedPacket = 6;

/// The first blocks of a file: the section, and an interface for each link.
std::string EncodeFileHeader(const std::vector<LinkInfo>& links, std::string_view version);

/// `number` counts the records of the file from 1.
std::string EncodeRecord(const Record& record, uint64_t number);

/// Decodes a record and its number from the body of a block, that is what lies between its two
/// length fields. Blocks of other types are errors. Error messages do not contain the position.
struct Numbered {
  uint64_t number = 0;
  Record record;
};
Result<Numbered> DecodeRecord(uint32_t type, std::string_view body);

/// Whether a block of this type holds a record.
bool IsRecord(uint32_t type);

}  // namespace pheromone::capture
