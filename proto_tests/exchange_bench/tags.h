// Virtual RFID tags on the map of exchange_bench, in rows and columns over all of it, and requests
// to them with their correct answers. Each tag has a block from WriteOnAll.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "protocol/tag_messages.h"

namespace pheromone::bench {

/// Tables [[tag]] for `per_side` times as many tags, on a map of `map_mm` along each side.
std::string TagTables(int per_side, int map_mm);

class TagSites {
 public:
  TagSites(int per_side, int map_mm) : per_side_(per_side), map_mm_(map_mm) {}

  size_t size() const { return static_cast<size_t>(per_side_) * static_cast<size_t>(per_side_); }

  /// From the place of the tag, which is one of size().
  protocol::Message Scan(uint8_t client, size_t tag) const;
  protocol::Message Read(uint8_t client, size_t tag) const;
  /// Replaces what the client wrote there. The object is `seq`.
  protocol::Message Write(uint8_t client, size_t tag, uint8_t seq) const;

  bool IsScanAnswer(const protocol::Message& answer, uint8_t client, size_t tag) const;
  static bool IsReadAnswer(const protocol::Message& answer, uint8_t client, size_t tag);
  static bool IsWriteAnswer(const protocol::Message& answer, uint8_t client, size_t tag,
                            uint8_t seq);

 private:
  int32_t CoordinateOf(size_t index) const;  // mm
  int32_t XOf(size_t tag) const { return CoordinateOf(tag % static_cast<size_t>(per_side_)); }
  int32_t YOf(size_t tag) const { return CoordinateOf(tag / static_cast<size_t>(per_side_)); }

  int per_side_;
  int map_mm_;
};

}  // namespace pheromone::bench
