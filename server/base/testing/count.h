// How often a piece of text occurs in another one, for tests of pictures and tables.
#pragma once

#include <cstddef>
#include <string_view>

namespace pheromone {

/// Occurrences may overlap. `part` is not empty.
inline size_t CountOf(std::string_view text, std::string_view part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

}  // namespace pheromone
