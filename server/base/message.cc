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

std::string Quoted(std::string_view found) {
  constexpr size_t kLongest = 32;
  std::string text = "\"";
  for (const char byte : found.substr(0, kLongest)) {
    text += byte >= ' ' && byte <= '~' ? byte : '?';
  }
  return text + (found.size() > kLongest ? "...\"" : "\"");
}

}  // namespace pheromone
