#include "server/formats/nets/pnml_arc.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "server/core/petri/net.h"
#include "server/formats/nets/pnml_xml.h"

namespace pheromone::nets {
namespace {

std::optional<uint32_t> ParseNumber(std::string_view text) {
  uint32_t number = 0;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, number);
  if (text.empty() || error != std::errc() || at != end || number > petri::kMaxTokens) {
    return std::nullopt;
  }
  return number;
}

// The text up to a comma, which is removed with it.
std::string_view NextItem(std::string_view* text) {
  const size_t comma = std::min(text->find(','), text->size());
  const std::string_view item = TrimXmlSpace(text->substr(0, comma));
  text->remove_prefix(std::min(comma + 1, text->size()));
  return item;
}

template <size_t kSize>
bool IsOneOf(const std::array<std::string_view, kSize>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

std::vector<std::string> ArcKindWords(const pugi::xml_node& arc) {
  std::vector<std::string> words = {arc.attribute("type").value(),
                                    arc.attribute("arctype").value()};
  for (const pugi::xml_node& child : arc.children()) {
    if (const std::string_view name = LocalName(child); name == "type" || name == "arctype") {
      words.emplace_back(child.attribute("value").value());
      words.push_back(LabelText(child));
      words.push_back(TextOf(child));
    }
  }
  words.erase(std::remove(words.begin(), words.end(), ""), words.end());
  return words;
}

std::optional<PnmlArcKind> ArcKindOf(std::string_view word) {
  constexpr std::array<std::string_view, 3> kNormal = {"normal", "regular", "timed"};
  constexpr std::array<std::string_view, 2> kRead = {"read", "test"};
  constexpr std::array<std::string_view, 2> kInhibitor = {"inhibitor", "tapnInhibitor"};
  return IsOneOf(kNormal, word)      ? std::optional(PnmlArcKind::kNormal)
         : IsOneOf(kRead, word)      ? std::optional(PnmlArcKind::kRead)
         : IsOneOf(kInhibitor, word) ? std::optional(PnmlArcKind::kInhibitor)
                                     : std::nullopt;
}

std::optional<uint32_t> ParseCount(std::string_view text) {
  if (text.find(',') == std::string_view::npos) {
    return ParseNumber(text);
  }
  std::optional<uint32_t> count;
  while (!text.empty()) {
    const bool is_default = NextItem(&text) == "Default";
    const std::optional<uint32_t> number = ParseNumber(NextItem(&text));
    if (!number || (is_default && count) || (!is_default && number != 0u)) {
      return std::nullopt;
    }
    if (is_default) {
      count = number;
    }
  }
  return count;
}

bool IsFreeOfTime(std::string_view text) {
  std::string dense(text);
  dense.erase(std::remove(dense.begin(), dense.end(), ' '), dense.end());
  return dense.empty() || dense == "[0,inf)" || dense == "<inf";
}

bool IsPtNetType(std::string_view type) {
  constexpr std::array<std::string_view, 6> kNames = {
      "ptnet", "ptNetb", "inhibitorptnet", "resetinhibitorptnet", "pnmlcoremodel", "PTNet"};
  if (type == "P/T net") {
    return true;
  }
  std::string_view name = type.substr(type.rfind('/') + 1);
  if (name.ends_with(".pntd")) {
    name.remove_suffix(5);
  }
  return IsOneOf(kNames, name);
}

}  // namespace pheromone::nets
