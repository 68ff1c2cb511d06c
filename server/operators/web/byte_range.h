// The Range header of a download (RFC 9110, section 14): which bytes of a file are wanted.
//
//   const ByteRange range = ParseRange("bytes=100-", 1000);      // 900 bytes from 100 on
//
// A header that is invalid, names another unit or several ranges means the whole file, as the RFC
// permits. Functions of their arguments; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace pheromone::web {

struct ByteRange {
  enum class Kind : uint8_t {
    kWhole,          // status 200
    kPart,           // status 206
    kUnsatisfiable,  // status 416: it begins at or after the end
  };
  Kind kind = Kind::kWhole;
  uint64_t first = 0;
  uint64_t count = 0;
  bool operator==(const ByteRange&) const = default;
};

/// `header` may be empty.
ByteRange ParseRange(std::string_view header, uint64_t file_bytes);

/// The value of the header Content-Range.
std::string ContentRange(const ByteRange& range, uint64_t file_bytes);

}  // namespace pheromone::web
