#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "server/formats/nets/core_net.h"
#include "server/formats/nets/pnml.h"
#include "server/formats/nets/pnml_xml.h"

namespace pheromone::nets {
namespace {

using petri::Arc;
using petri::Claim;
using petri::Net;
using petri::Place;
using petri::Transition;

enum class ArcKind { kNormal, kRead, kInhibitor };

bool IsAsciiLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool IsNameCharacter(char c) {
  return IsAsciiLetter(c) || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
}

// An NCName (Namespaces in XML 1.0, section 3), of ASCII only: all readers agree on those.
bool IsNcName(std::string_view id) {
  return !id.empty() && (IsAsciiLetter(id[0]) || id[0] == '_') &&
         std::all_of(id.begin(), id.end(), IsNameCharacter);
}

// The IDs of a document: each once, and each an NCName.
class XmlIds {
 public:
  explicit XmlIds(const Net& net) {
    for (const Place& place : net.places) {
      Keep(place.id);
    }
    for (const Transition& transition : net.transitions) {
      Keep(transition.id);
    }
  }

  /// For a place or transition of the net: its own ID, if it can be written.
  std::string Of(const std::string& id) { return IsNcName(id) ? id : New(id); }

  /// An ID like `wanted` that nothing else has.
  std::string New(std::string_view wanted) {
    std::string base(wanted);
    for (char& c : base) {
      c = IsNameCharacter(c) ? c : '_';
    }
    if (!IsNcName(base)) {
      base = "_" + base;
    }
    std::string id = base;
    for (size_t& number = next_[base]; !used_.insert(id).second;) {
      id = base + "_" + std::to_string(++number);
    }
    return id;
  }

 private:
  void Keep(const std::string& id) {
    if (IsNcName(id)) {
      used_.insert(id);
    }
  }

  std::unordered_set<std::string> used_;
  std::unordered_map<std::string, size_t> next_;
};

class PnmlWriter {
 public:
  explicit PnmlWriter(const Net& net) : net_(net), ids_(net) {}

  std::string Write() && {
    xml_ = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<pnml";
    AppendAttribute("xmlns", kPnmlNamespace, &xml_);
    xml_ += ">\n  <net";
    AppendAttribute("id", ids_.New("net"), &xml_);
    AppendAttribute("type", kPtNetType, &xml_);
    xml_ += ">\n    <name><text>";
    AppendText(net_.name, &xml_);
    xml_ += "</text></name>\n";
    WriteNetProperties();
    xml_ += "    <page";
    AppendAttribute("id", ids_.New("page"), &xml_);
    xml_ += ">\n";
    for (const Place& place : net_.places) {
      place_ids_.push_back(ids_.Of(place.id));
      WritePlace(place, place_ids_.back());
    }
    for (const Transition& transition : net_.transitions) {
      WriteTransition(transition);
    }
    xml_ += "    </page>\n  </net>\n</pnml>\n";
    return std::move(xml_);
  }

 private:
  void WriteNetProperties() {
    const bool is_kept = IsKeptByText(net_.name);
    if (is_kept && net_.claims.empty()) {
      return;
    }
    OpenToolSpecific("    ");
    if (!is_kept) {
      xml_ += "      <properties";
      AppendAttribute("name", net_.name, &xml_);
      xml_ += "/>\n";
    }
    for (const Claim& claim : net_.claims) {
      xml_ += "      <claim";
      AppendAttribute("identifier", claim.id, &xml_);
      AppendAttribute("text", claim.text, &xml_);
      xml_ += "/>\n";
    }
    xml_ += "    </toolspecific>\n";
  }

  void WritePlace(const Place& place, const std::string& id) {
    xml_ += "      <place";
    AppendAttribute("id", id, &xml_);
    xml_ += ">\n";
    WriteName(place.name);
    if (place.tokens > 0) {
      xml_ += "        <initialMarking><text>" + std::to_string(place.tokens) +
              "</text></initialMarking>\n";
    }
    WriteProperties(place, id, place.box);
    xml_ += "      </place>\n";
  }

  void WriteTransition(const Transition& transition) {
    const std::string id = ids_.Of(transition.id);
    xml_ += "      <transition";
    AppendAttribute("id", id, &xml_);
    xml_ += ">\n";
    WriteName(transition.name);
    WriteProperties(transition, id, "");
    xml_ += "      </transition>\n";
    for (const Arc& arc : transition.takes) {
      WriteArc(place_ids_[arc.place], id, arc.weight, ArcKind::kNormal);
    }
    for (const Arc& arc : transition.reads) {
      WriteArc(place_ids_[arc.place], id, arc.weight, ArcKind::kRead);
    }
    for (const Arc& arc : transition.inhibitors) {
      WriteArc(place_ids_[arc.place], id, arc.weight, ArcKind::kInhibitor);
    }
    for (const Arc& arc : transition.gives) {
      WriteArc(id, place_ids_[arc.place], arc.weight, ArcKind::kNormal);
    }
  }

  void WriteName(const std::string& name) {
    if (!name.empty()) {
      xml_ += "        <name><text>";
      AppendText(name, &xml_);
      xml_ += "</text></name>\n";
    }
  }

  template <typename Node>
  void WriteProperties(const Node& node, const std::string& id, const std::string& box) {
    std::string properties;
    const auto add = [&](std::string_view name, const std::string& value, bool is_needed) {
      if (is_needed) {
        AppendAttribute(name, value, &properties);
      }
    };
    add("identifier", node.id, node.id != id);
    add("name", node.name, !IsKeptByText(node.name));
    add("box", box, !box.empty());
    add("owner", node.owner, !node.owner.empty());
    add("tag", node.tag, !node.tag.empty());
    add("does", node.does, !node.does.empty());
    if (!properties.empty()) {
      OpenToolSpecific("        ");
      xml_ += "          <properties" + properties + "/>\n        </toolspecific>\n";
    }
  }

  void WriteArc(const std::string& source, const std::string& target, uint32_t weight,
                ArcKind kind) {
    xml_ += "      <arc";
    AppendAttribute("id", ids_.New("a" + std::to_string(++arcs_)), &xml_);
    AppendAttribute("source", source, &xml_);
    AppendAttribute("target", target, &xml_);
    std::string labels;
    if (kind != ArcKind::kNormal) {
      labels = kind == ArcKind::kRead ? "<type value=\"read\"/>" : "<type value=\"inhibitor\"/>";
    }
    if (weight != 1) {
      labels += "<inscription><text>" + std::to_string(weight) + "</text></inscription>";
    }
    xml_ += labels.empty() ? "/>\n" : ">" + labels + "</arc>\n";
  }

  void OpenToolSpecific(std::string_view indent) {
    xml_ += indent;
    xml_ += "<toolspecific";
    AppendAttribute("tool", kPnmlTool, &xml_);
    AppendAttribute("version", kPnmlToolVersion, &xml_);
    xml_ += ">\n";
  }

  static bool IsKeptByText(std::string_view name) {
    return FirstNonXml(name) == name.size() && TrimXmlSpace(name) == name;
  }

  const Net& net_;
  XmlIds ids_;
  std::vector<std::string> place_ids_;
  size_t arcs_ = 0;
  std::string xml_;
};

}  // namespace

std::string ToPnml(const Net& net) {
  assert(CheckNet(net).ok());
  return PnmlWriter(net).Write();
}

}  // namespace pheromone::nets
