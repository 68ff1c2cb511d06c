#include "server/base/escape.h"

#include <algorithm>
#include <cstdint>

#include "server/base/utf8.h"

namespace pheromone {
namespace {

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
    const Utf8Character it = FirstCharacter(text);
    if (it.state != Utf8Character::kValid) {
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
    if (const Utf8Character it = FirstCharacter(end);
        it.state == Utf8Character::kUnfinished && it.bytes == bytes) {
      return bytes;
    }
  }
  return 0;
}

}  // namespace pheromone
