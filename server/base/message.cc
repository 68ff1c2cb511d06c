#include "server/base/message.h"

namespace pheromone {

Error AtByte(std::string_view name, size_t offset, std::string_view what) {
  return Error{std::string(name) + ": byte " + std::to_string(offset) + ": " + std::string(what)};
}

Error AtLine(std::string_view name, size_t line, size_t column, std::string_view what) {
  std::string text = std::string(name) + ":" + std::to_string(line);
  if (column != 0) {
    text += ":" + std::to_string(column);
  }
  return Error{text + ": " + std::string(what)};
}

std::string Quoted(std::string_view found, size_t longest) {
  std::string text = "\"";
  for (const char byte : found.substr(0, longest)) {
    text += byte >= ' ' && byte <= '~' ? byte : '?';
  }
  return text + (found.size() > longest ? "...\"" : "\"");
}

Status SkipByteOrderMark(std::string_view* text) {
  if (text->starts_with("\xFF\xFE") || text->starts_with("\xFE\xFF") ||
      text->starts_with(std::string_view("\0\0\xFE\xFF", 4))) {
    return Error{"found the byte order mark of UTF-16 or UTF-32, expected UTF-8"};
  }
  if (text->starts_with("\xEF\xBB\xBF")) {
    text->remove_prefix(3);
  }
  return Ok();
}

}  // namespace pheromone
