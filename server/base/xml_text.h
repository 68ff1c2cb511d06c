// XML 1.0, section 2.4: any text as the content of an element, or of an attribute in double quotes.
//
//   "<text>" + EscapeXml("a < b") + "</text>"    // <text>a &lt; b</text>
//
// Any thread.
#pragma once

#include <string>
#include <string_view>

namespace pheromone {

inline std::string EscapeXml(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '&':
        safe += "&amp;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

}  // namespace pheromone
