// What reading and writing of PNML have in common: names of elements, and text that XML can hold.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <pugixml.hpp>

namespace pheromone::nets {

inline constexpr std::string_view kPnmlTool = "pheromone";
inline constexpr std::string_view kPnmlToolVersion = "1";
inline constexpr std::string_view kPnmlNamespace = "http://www.pnml.org/version-2009/grammar/pnml";
inline constexpr std::string_view kPtNetType = "http://www.pnml.org/version-2009/grammar/ptnet";

/// Where the text is not UTF-8 or has a character that XML 1.0 forbids (section 2.2); its size if
/// nowhere.
size_t FirstNonXml(std::string_view text);

/// Without spaces, tabs and ends of lines around it.
std::string_view TrimXmlSpace(std::string_view text);

/// The name without its namespace's prefix; empty for what is not an element.
std::string_view LocalName(const pugi::xml_node& node);

/// The first child of that local name.
pugi::xml_node FindChild(const pugi::xml_node& parent, std::string_view name);

/// All text directly inside of an element, trimmed.
std::string TextOf(const pugi::xml_node& node);

/// The trimmed text of a label: of its <text>, or <value> as PIPE has it.
std::string LabelText(const pugi::xml_node& label);

/// ` NAME="VALUE"`, or ` NAME-percent="PERCENT-ENCODED"` if XML cannot hold the value.
void AppendAttribute(std::string_view name, std::string_view value, std::string* xml);

/// What AppendAttribute wrote; nothing if there is neither or it is damaged.
std::optional<std::string> ReadAttribute(const pugi::xml_node& node, const std::string& name);

/// Text between tags. What XML cannot hold is replaced by question marks.
void AppendText(std::string_view text, std::string* xml);

}  // namespace pheromone::nets
