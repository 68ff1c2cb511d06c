// Characters of text in UTF-8, without trust in the text.
//
//   const Utf8Character it = FirstCharacter("\xC3\xA9t");   // 2 bytes, U+00E9
//   if (it.state == Utf8Character::kValid) { text.remove_prefix(it.bytes); }
//
// Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace pheromone {

struct Utf8Character {
  size_t bytes = 1;         ///< unless it is valid: of the maximal part of a sequence (section 3.9)
  uint32_t code_point = 0;  ///< if it is valid
  /// Unfinished: the text ends within it, and the rest may follow.
  enum { kValid, kInvalid, kUnfinished } state = kValid;
};

/// The first character of `text`, which is not empty: table 3-7 of Unicode 15.
Utf8Character FirstCharacter(std::string_view text);

}  // namespace pheromone
