#include "server/formats/nets/pnml_firing.h"

#include <initializer_list>
#include <string_view>

#include "server/formats/nets/pnml_arc.h"
#include "server/formats/nets/pnml_xml.h"

namespace pheromone::nets {
namespace {

using pugi::xml_node;

// An attribute or child of that name: its label, its text, or that of all that is in it.
std::string ValueOf(const xml_node& element, const char* name) {
  if (const std::string_view attribute = element.attribute(name).value(); !attribute.empty()) {
    return std::string(TrimXmlSpace(attribute));
  }
  const xml_node child = FindChild(element, name);
  std::string text = LabelText(child);
  text = text.empty() ? TextOf(child) : text;
  if (!text.empty() || !child) {
    return text;
  }
  return ValueOf(child, "value");
}

// An interval of MathML, as TINA has it: <interval closure="closed"><cn>0</cn><ci>infty</ci>.
std::string IntervalOf(const xml_node& delay) {
  const xml_node interval = FindChild(delay, "interval");
  std::string text;
  for (const xml_node& bound : interval.children()) {
    text += (text.empty() ? "" : ",") + TextOf(bound);
  }
  return text;
}

bool IsFree(std::string_view text) {
  for (const std::string_view free :
       {"0", "0.0", "0,infty", "0,inf", "[0,inf[", "[0,w[", "[0,infty)", "false"}) {
    if (text == free) {
      return true;
    }
  }
  return IsFreeOfTime(text);
}

}  // namespace

std::string GuardOf(const xml_node& transition) {
  for (const char* const name : {"guard", "condition"}) {
    const std::string text = ValueOf(transition, name);
    if (!text.empty() && text != "true" && text != "[true]") {
      return text;
    }
  }
  return "";
}

std::string TimeOf(const xml_node& transition) {
  for (const char* const name : {"delay", "interval", "time", "timing", "eft", "lft"}) {
    const std::string interval = IntervalOf(FindChild(transition, name));
    const std::string text = interval.empty() ? ValueOf(transition, name) : interval;
    const bool is_open_end = std::string_view(name) == "lft" && text == "inf";
    if (!text.empty() && !IsFree(text) && !is_open_end) {
      return text;
    }
  }
  return "";
}

std::string PriorityOf(const xml_node& transition) {
  const std::string timed = ValueOf(transition, "timed");
  const std::string priority = ValueOf(transition, "priority");
  const std::string kind = timed == "true" ? "timed" : timed == "false" ? "immediate" : "";
  return kind + (kind.empty() || priority.empty() ? "" : ", ") +
         (priority.empty() ? "" : "priority " + priority);
}

}  // namespace pheromone::nets
