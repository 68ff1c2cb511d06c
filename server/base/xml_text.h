// XML 1.0, section 2.4: any text as the content of an element, or of an attribute in double quotes.
// What XML cannot have (section 2.2), and what is not UTF-8, is escaped as where it is printed.
//
//   "<text>" + EscapeXml("a < b") + "</text>"    // <text>a &lt; b</text>
//
// Any thread.
#pragma once

#include <string>
#include <string_view>

#include "server/base/escape.h"

namespace pheromone {

inline std::string EscapeXml(std::string_view text) {
  std::string safe;
  for (const char c : EscapeControls(text, "\n\t")) {
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
