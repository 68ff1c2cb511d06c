// Where the records of a segment begin, read straight off server/store/journal/README.md and
// without the code that is to be tested.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/bytes.h"

namespace pheromone::journal::testing {

struct Border {
  size_t at = 0;          ///< a record begins here
  uint64_t sequence = 0;  ///< the last event before it
  uint64_t durable = 0;   ///< what it says was on the disk, if it is a mark
};

/// Those of a segment that is whole, and the end of the file.
inline std::vector<Border> BordersOf(const std::string& file, uint64_t sequence = 0) {
  constexpr size_t kHeaderBytes = 36;
  constexpr uint8_t kEvent = 1;
  constexpr uint8_t kGroup = 2;
  constexpr uint8_t kEnd = 4;
  constexpr uint8_t kEventInPieces = 6;
  std::vector<Border> borders;
  for (size_t at = kHeaderBytes; at < file.size();) {
    ByteReader reader(std::string_view(file).substr(at));
    const uint32_t length = reader.U32();
    reader.U32();  // the checksum
    const uint8_t kind = reader.U8();
    const uint64_t number = reader.U64();
    borders.push_back({at, sequence, kind == kGroup || kind == kEnd ? number : 0});
    sequence = kind == kEvent || kind == kEventInPieces ? number : sequence;
    at += 8 + length;
  }
  borders.push_back({file.size(), sequence, 0});
  return borders;
}

/// The last border at or before a byte.
inline Border LastBefore(const std::vector<Border>& borders, size_t byte) {
  Border last;
  for (const Border& border : borders) {
    last = border.at <= byte ? border : last;
  }
  return last;
}

/// The highest that the marks say was on the disk, but for the one that begins at `except`.
inline uint64_t DurableByMarks(const std::vector<Border>& borders, size_t except) {
  uint64_t durable = 0;
  for (const Border& border : borders) {
    durable = border.at == except ? durable : std::max(durable, border.durable);
  }
  return durable;
}

}  // namespace pheromone::journal::testing
