#include "server/formats/nets/pnml_source.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "server/base/message.h"
#include "server/base/text.h"
#include "server/formats/nets/pnml_xml.h"

namespace pheromone::nets {
namespace {

constexpr std::ptrdiff_t kMaxTags = 8'000'000;  // 64 bytes each, in the library's tree

bool SaysLatin1(std::string_view text) {
  const std::string prolog = ToLower(text.substr(0, std::min(text.find("?>"), size_t{200})));
  return prolog.starts_with("<?xml") && prolog.find("iso-8859-1") != std::string::npos;
}

// A byte of ISO-8859-1 is a code point of Unicode.
std::string Utf8OfLatin1(std::string_view text) {
  std::string utf8;
  for (const char c : text) {
    const auto byte = static_cast<uint8_t>(c);
    if (byte < 0x80) {
      utf8 += c;
    } else {
      utf8 += {static_cast<char>(0xC0 | byte >> 6), static_cast<char>(0x80 | (byte & 0x3F))};
    }
  }
  return utf8;
}

size_t OffsetIn(std::string_view text, std::ptrdiff_t offset) {
  return std::min(text.size(), static_cast<size_t>(std::max<std::ptrdiff_t>(0, offset)));
}

}  // namespace

PnmlSource::PnmlSource(std::string_view name, std::string_view text)
    : name_(name), text_(SaysLatin1(text) ? Utf8OfLatin1(text) : std::string(text)) {}

bool PnmlSource::Parse() {
  if (const size_t bad = FirstNonXml(text_); bad != text_.size()) {
    return FailAt(bad, "byte " + std::to_string(bad), "text in UTF-8, or ISO-8859-1 if it says so");
  }
  if (std::count(text_.begin(), text_.end(), '<') > kMaxTags) {
    return FailAt(0, "more than " + std::to_string(kMaxTags) + " tags", "a smaller net");
  }
  const pugi::xml_parse_result parsed =
      document_.load_buffer(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    const size_t at = OffsetIn(text_, parsed.offset);
    return FailAt(at, Quoted(std::string_view(text_).substr(at)),
                  std::string("XML (") + parsed.description() + ")");
  }
  return true;
}

bool PnmlSource::Fail(const pugi::xml_node& at, const std::string& found,
                      std::string_view expected) {
  return FailAt(OffsetIn(text_, at.offset_debug()), found, expected);
}

bool PnmlSource::FailAt(size_t offset, const std::string& found, std::string_view expected) {
  const auto line =
      1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(offset), '\n');
  error_ = AtLine(name_, static_cast<size_t>(line), 0,
                  "found " + found + ", expected " + std::string(expected));
  return false;
}

}  // namespace pheromone::nets
