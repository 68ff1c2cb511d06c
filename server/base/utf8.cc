#include "server/base/utf8.h"

namespace pheromone {

Utf8Character FirstCharacter(std::string_view text) {
  const auto byte_at = [&](size_t i) { return static_cast<uint8_t>(text[i]); };
  const uint8_t lead = byte_at(0);
  if (lead < 0x80) {
    return {1, lead, Utf8Character::kValid};
  }
  const size_t length = lead >= 0xC2 && lead <= 0xDF   ? 2
                        : lead >= 0xE0 && lead <= 0xEF ? 3
                        : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                       : 0;
  if (length == 0) {
    return {1, 0, Utf8Character::kInvalid};
  }
  uint32_t code_point = lead & (0x7FU >> length);
  for (size_t i = 1; i < length; ++i) {
    if (i == text.size()) {
      return {i, 0, Utf8Character::kUnfinished};
    }
    // No longer form than needed, no surrogates, nothing above U+10FFFF.
    const uint8_t least = i > 1 ? 0x80 : lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
    const uint8_t most = i > 1 ? 0xBF : lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
    const uint8_t byte = byte_at(i);
    if (byte < least || byte > most) {
      return {i, 0, Utf8Character::kInvalid};
    }
    code_point = code_point << 6 | (byte & 0x3FU);
  }
  return {length, code_point, Utf8Character::kValid};
}

}  // namespace pheromone
