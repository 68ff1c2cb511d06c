#include "server/operators/web/byte_range.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "server/base/text.h"

namespace pheromone::web {
namespace {

constexpr std::string_view kUnit = "bytes=";

// Of digits only. A number that does not fit is far beyond any file.
std::optional<uint64_t> ToNumber(std::string_view text) {
  uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (stop != end || text.empty()) {
    return std::nullopt;
  }
  return error == std::errc() ? number : UINT64_MAX;
}

}  // namespace

ByteRange ParseRange(std::string_view header, uint64_t file_bytes) {
  const ByteRange whole{ByteRange::Kind::kWhole, 0, file_bytes};
  const ByteRange none{ByteRange::Kind::kUnsatisfiable, 0, 0};
  const std::string_view text =
      header.starts_with(kUnit) ? Trim(header.substr(kUnit.size()), " \t") : std::string_view();
  const size_t dash = text.find('-');
  if (dash == std::string_view::npos) {
    return whole;
  }
  const std::string_view last_text = text.substr(dash + 1);
  const auto first = ToNumber(text.substr(0, dash));
  const auto last = ToNumber(last_text);
  if (dash == 0) {  // the last so many bytes
    if (!last) {
      return whole;
    }
    const uint64_t count = std::min(*last, file_bytes);
    return count == 0 ? none : ByteRange{ByteRange::Kind::kPart, file_bytes - count, count};
  }
  if (!first || (!last && !last_text.empty()) || (last && *last < *first)) {
    return whole;
  }
  if (*first >= file_bytes) {
    return none;
  }
  const uint64_t end = last ? std::min(*last, file_bytes - 1) + 1 : file_bytes;
  return {ByteRange::Kind::kPart, *first, end - *first};
}

std::string ContentRange(const ByteRange& range, uint64_t file_bytes) {
  const std::string size = '/' + std::to_string(file_bytes);
  return range.kind == ByteRange::Kind::kUnsatisfiable
             ? "bytes *" + size
             : "bytes " + std::to_string(range.first) + '-' +
                   std::to_string(range.first + range.count - 1) + size;
}

}  // namespace pheromone::web
