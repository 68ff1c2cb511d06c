#include "server/formats/nets/pnml_xml.h"

#include <cstdint>

#include "server/base/percent.h"
#include "server/base/text.h"
#include "server/base/utf8.h"

namespace pheromone::nets {
namespace {

bool IsXmlCharacter(uint32_t code) {
  return code == '\t' || code == '\n' || code == '\r' || (code >= 0x20 && code < 0xD800) ||
         (code >= 0xE000 && code < 0xFFFE) || (code >= 0x10000 && code < 0x110000);
}

// The length of the character at the beginning, or 0 if it is none that XML allows.
size_t XmlCharacterLength(std::string_view text) {
  const Utf8Character it = FirstCharacter(text);
  return it.state == Utf8Character::kValid && IsXmlCharacter(it.code_point) ? it.bytes : 0;
}

// Tabs and ends of lines are escaped where a reader would turn them into spaces or other ends.
void AppendEscaped(std::string_view text, bool in_attribute, std::string* xml) {
  for (const char c : text) {
    if (c == '&') {
      *xml += "&amp;";
    } else if (c == '<') {
      *xml += "&lt;";
    } else if (c == '>') {
      *xml += "&gt;";
    } else if (c == '"' && in_attribute) {
      *xml += "&quot;";
    } else if (c == '\r' || (in_attribute && (c == '\n' || c == '\t'))) {
      *xml += "&#" + std::to_string(c) + ";";
    } else {
      *xml += c;
    }
  }
}

}  // namespace

size_t FirstNonXml(std::string_view text) {
  size_t at = 0;
  while (at < text.size()) {
    const size_t length = XmlCharacterLength(text.substr(at));
    if (length == 0) {
      return at;
    }
    at += length;
  }
  return at;
}

std::string_view TrimXmlSpace(std::string_view text) {
  return Trim(text, " \t\r\n");
}

std::string_view LocalName(const pugi::xml_node& node) {
  if (node.type() != pugi::node_element) {
    return {};
  }
  const std::string_view name = node.name();
  const size_t colon = name.rfind(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

pugi::xml_node FindChild(const pugi::xml_node& parent, std::string_view name) {
  return parent.find_child([&](const pugi::xml_node& node) { return LocalName(node) == name; });
}

std::string TextOf(const pugi::xml_node& node) {
  std::string text;
  for (const pugi::xml_node& child : node.children()) {
    if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) {
      text += child.value();
    }
  }
  return std::string(TrimXmlSpace(text));
}

std::string LabelText(const pugi::xml_node& label) {
  const pugi::xml_node text = FindChild(label, "text");
  return TextOf(text ? text : FindChild(label, "value"));
}

void AppendAttribute(std::string_view name, std::string_view value, std::string* xml) {
  *xml += ' ';
  *xml += name;
  if (FirstNonXml(value) == value.size()) {
    *xml += "=\"";
    AppendEscaped(value, true, xml);
  } else {
    *xml += "-percent=\"" + PercentEncode(value);
  }
  *xml += '"';
}

std::optional<std::string> ReadAttribute(const pugi::xml_node& node, const std::string& name) {
  if (const pugi::xml_attribute plain = node.attribute(name.c_str())) {
    return plain.value();
  }
  const pugi::xml_attribute encoded = node.attribute((name + "-percent").c_str());
  return encoded ? PercentDecode(encoded.value()) : std::nullopt;
}

void AppendText(std::string_view text, std::string* xml) {
  while (true) {
    const size_t good = FirstNonXml(text);
    AppendEscaped(text.substr(0, good), false, xml);
    if (good == text.size()) {
      return;
    }
    *xml += '?';
    text.remove_prefix(good + 1);
  }
}

}  // namespace pheromone::nets
