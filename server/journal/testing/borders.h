// Where the records of a segment begin, read straight off server/journal/README.md and without the
// code that is to be tested.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/base/bytes.h"

namespace pheromone::journal::testing {

struct Border {
  size_t at = 0;          ///< a record begins here
  uint64_t sequence = 0;  ///< the last event before it
};

/// Those of a segment that is whole, and the end of the file.
inline std::vector<Border> BordersOf(const std::string& file, uint64_t sequence = 0) {
  constexpr size_t kHeaderBytes = 36;
  constexpr uint8_t kEvent = 1;
  std::vector<Border> borders;
  for (size_t at = kHeaderBytes; at < file.size();) {
    ByteReader reader(std::string_view(file).substr(at));
    const uint32_t length = reader.U32();
    reader.U32();  // the checksum
    const uint8_t kind = reader.U8();
    const uint64_t number = reader.U64();
    borders.push_back({at, sequence});
    sequence = kind == kEvent ? number : sequence;
    at += 8 + length;
  }
  borders.push_back({file.size(), sequence});
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

}  // namespace pheromone::journal::testing
