// What formats ask of text: blanks around it removed, letters in one case (ASCII alone), quotes.
//
//   Trim(" 1.5\t")     // "1.5", a part of the argument
//   ToLower(".PNG")    // ".png"
//   CsvCell("a, b")    // "\"a, b\""
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

/// A cell of CSV, quoted if it has to be (RFC 4180).
inline std::string CsvCell(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    return std::string(text);
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c;
    quoted += c == '"' ? "\"" : "";
  }
  return quoted + '"';
}

}  // namespace pheromone
