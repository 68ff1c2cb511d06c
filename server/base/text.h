// What formats ask of text: blanks around it removed, letters in one case. ASCII alone.
//
//   Trim(" 1.5\t")     // "1.5", a part of the argument
//   ToLower(".PNG")    // ".png"
//
// Pure; any thread.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace pheromone {

/// Without the blanks around it. If there is nothing else, the empty end of `text`.
inline std::string_view Trim(std::string_view text, std::string_view blanks = " \t\r") {
  const size_t first = std::min(text.find_first_not_of(blanks), text.size());
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

/// With a to z for A to Z, whatever the locale.
inline std::string ToLower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return lower;
}

}  // namespace pheromone
