#include "server/formats/rdf/iri.h"

#include <algorithm>

#include "server/core/tags/symbols.h"
#include "server/formats/rdf/lexical.h"

namespace pheromone::tags {
namespace {

bool IsHexDigit(char c) {
  return IsDigit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

// Whether a segment of the path is "." or "..".
bool HasDotSegment(std::string_view iri) {
  const std::string_view path = iri.substr(0, iri.find_first_of("?#"));
  size_t begin = path.find(':') + 1;
  while (begin <= path.size()) {
    const size_t end = std::min(path.find('/', begin), path.size());
    const std::string_view segment = path.substr(begin, end - begin);
    if (segment == "." || segment == "..") {
      return true;
    }
    begin = end + 1;
  }
  return false;
}

bool IsBoundary(std::string_view text, size_t at) {
  return at >= text.size() || (static_cast<unsigned char>(text[at]) & 0xC0u) != 0x80u;
}

}  // namespace

bool IsIri(std::string_view text) {
  const size_t colon = text.find(':');
  if (colon == std::string_view::npos || colon + 1 == text.size() || !IsPlainUtf8(text) ||
      !IsXmlText(text) || !IsLetter(text.front())) {
    return false;
  }
  const bool is_scheme = std::all_of(
      text.begin(), text.begin() + static_cast<ptrdiff_t>(colon),
      [](char c) { return IsLetter(c) || IsDigit(c) || c == '+' || c == '-' || c == '.'; });
  if (!is_scheme || text.find_first_of(" <>\"{}|^`\\") != std::string_view::npos ||
      std::count(text.begin(), text.end(), '#') > 1) {
    return false;
  }
  for (size_t i = text.find('%'); i != std::string_view::npos; i = text.find('%', i + 1)) {
    if (i + 2 >= text.size() || !IsHexDigit(text[i + 1]) || !IsHexDigit(text[i + 2])) {
      return false;
    }
  }
  return !HasDotSegment(text);
}

std::optional<size_t> SplitOf(std::string_view iri, size_t most_bytes) {
  const auto fits = [&](size_t at) { return at <= most_bytes && iri.size() - at <= most_bytes; };
  const size_t last = iri.find_last_of("#/");
  if (last != std::string_view::npos && last + 1 < iri.size() && fits(last + 1)) {
    return last + 1;
  }
  if (iri.size() <= most_bytes) {
    return 0;
  }
  for (size_t at = std::min(most_bytes, iri.size() - 1); at > 0; --at) {
    if (fits(at) && IsBoundary(iri, at)) {
      return at;
    }
  }
  return std::nullopt;
}

}  // namespace pheromone::tags
