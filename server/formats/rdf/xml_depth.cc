#include "server/formats/rdf/xml_depth.h"

#include <algorithm>

namespace pheromone::ctl {
namespace {

// The offset behind `end`, which is looked for from `at` on.
size_t Behind(std::string_view text, std::string_view end, size_t at) {
  const size_t found = text.find(end, at);
  return found == std::string_view::npos ? text.size() : found + end.size();
}

// The offset of the > that ends the tag or declaration at `at`; a quoted one does not.
size_t EndOfTag(std::string_view text, size_t at) {
  for (; at < text.size() && text[at] != '>'; ++at) {
    if (text[at] == '"' || text[at] == '\'') {
      at = std::min(text.find(text[at], at + 1), text.size() - 1);
    }
  }
  return at;
}

}  // namespace

size_t TooDeepAt(std::string_view text) {
  size_t depth = 0;
  for (size_t at = text.find('<'); at < text.size(); at = text.find('<', at)) {
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("<!--")) {
      at = Behind(text, "-->", at);
    } else if (rest.starts_with("<![CDATA[")) {
      at = Behind(text, "]]>", at);
    } else if (rest.starts_with("<?")) {
      at = Behind(text, "?>", at);
    } else if (rest.starts_with("<!DOCTYPE")) {
      at += 2;  // what it declares comes next
    } else if (rest.starts_with("<!")) {
      const size_t end = EndOfTag(text, at);
      const std::string_view declared = text.substr(at + 2, end - at - 2);
      if (declared.find('<') != std::string_view::npos ||
          declared.find("&#") != std::string_view::npos) {
        return at;
      }
      at = end;
    } else if (rest.starts_with("</")) {
      depth -= depth > 0 ? 1 : 0;
      at = EndOfTag(text, at);
    } else {
      const size_t end = EndOfTag(text, at);
      if (text[end - 1] != '/' && ++depth > kMaxXmlDepth) {
        return at;
      }
      at = end;
    }
  }
  return text.size();
}

}  // namespace pheromone::ctl
