#include "server/base/escape.h"

#include <algorithm>
#include <cstdint>

namespace pheromone {
namespace {

struct Character {
  size_t bytes = 1;
  uint32_t code_point = 0;
  enum { kValid, kInvalid, kUnfinished } state = kValid;
};

// The first character of `text`, which is not empty: table 3-7 of Unicode 15.
Character FirstOf(std::string_view text) {
  const auto byte_at = [&](size_t i) { return static_cast<uint8_t>(text[i]); };
  const uint8_t lead = byte_at(0);
  if (lead < 0x80) {
    return {1, lead, Character::kValid};
  }
  const size_t length = lead >= 0xC2 && lead <= 0xDF   ? 2
                        : lead >= 0xE0 && lead <= 0xEF ? 3
                        : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                       : 0;
  if (length == 0) {
    return {1, 0, Character::kInvalid};
  }
  uint32_t code_point = lead & (0x7FU >> length);
  for (size_t i = 1; i < length; ++i) {
    if (i == text.size()) {
      return {i, 0, Character::kUnfinished};
    }
    // No longer form than needed, no surrogates, nothing above U+10FFFF.
    const uint8_t least = i > 1 ? 0x80 : lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
    const uint8_t most = i > 1 ? 0xBF : lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
    const uint8_t byte = byte_at(i);
    if (byte < least || byte > most) {
      return {i, 0, Character::kInvalid};
    }
    code_point = code_point << 6 | (byte & 0x3FU);
  }
  return {length, code_point, Character::kValid};
}

bool IsControl(uint32_t c) {
  return c < 0x20 || (c >= 0x7F && c < 0xA0) || c == 0x061C || c == 0x200E || c == 0x200F ||
         (c >= 0x202A && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069);
}

void AppendEscape(uint32_t code_point, std::string* text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  *text += "\\u";
  for (int shift = 12; shift >= 0; shift -= 4) {
    *text += kDigits[code_point >> shift & 0xFU];
  }
}

}  // namespace

std::string EscapeControls(std::string_view text, std::string_view kept) {
  constexpr uint32_t kReplacement = 0xFFFD;
  std::string escaped;
  escaped.reserve(text.size());
  while (!text.empty()) {
    const auto plain = static_cast<size_t>(
        std::find_if(text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }) -
        text.begin());
    escaped += text.substr(0, plain);
    text.remove_prefix(plain);
    if (text.empty()) {
      break;
    }
    const Character it = FirstOf(text);
    if (it.state != Character::kValid) {
      AppendEscape(kReplacement, &escaped);
    } else if (IsControl(it.code_point) && kept.find(text.front()) == std::string_view::npos) {
      AppendEscape(it.code_point, &escaped);
    } else {
      escaped += text.substr(0, it.bytes);
    }
    text.remove_prefix(it.bytes);
  }
  return escaped;
}

size_t UnfinishedAtEnd(std::string_view text) {
  for (size_t bytes = 1; bytes <= std::min<size_t>(text.size(), 3); ++bytes) {
    const std::string_view end = text.substr(text.size() - bytes);
    if (const Character it = FirstOf(end);
        it.state == Character::kUnfinished && it.bytes == bytes) {
      return bytes;
    }
  }
  return 0;
}

}  // namespace pheromone
