#include "server/formats/nets/pnml.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <pugixml.hpp>

#include "server/base/message.h"
#include "server/formats/nets/pnml_arc.h"
#include "server/formats/nets/pnml_firing.h"
#include "server/formats/nets/pnml_source.h"
#include "server/formats/nets/pnml_xml.h"

namespace pheromone::nets {
namespace {

using petri::Arc;
using petri::Net;
using petri::Place;
using petri::Transition;
using pugi::xml_node;

constexpr size_t kMaxDepth = 64;
constexpr size_t kMaxShownType = 200;
constexpr size_t kMaxReferences = 1000;  // from one to the next

// Our own <toolspecific> of a net, place or transition, if there is one.
xml_node OwnData(const xml_node& parent) {
  return parent.find_child([](const xml_node& node) {
    return LocalName(node) == "toolspecific" && node.attribute("tool").value() == kPnmlTool;
  });
}

class PnmlReader {
 public:
  PnmlReader(std::string_view name, std::string_view text) : name_(name), source_(name, text) {}

  Result<Net> Read(std::string* warning) && {
    if (!source_.Parse() || !ReadDocument(source_.document().document_element())) {
      return Error{source_.error()};
    }
    if (const Status sound = CheckNet(net_); !sound.ok()) {
      return Error{std::string(name_) + ": " + sound.error()};
    }
    if (warning != nullptr) {
      *warning = std::move(warning_);
    }
    return std::move(net_);
  }

 private:
  struct Node {
    enum class Kind { kPlace, kTransition, kOther };

    xml_node element;
    Kind kind = Kind::kOther;
    uint32_t index = 0;      // of a place or transition
    std::string_view ref{};  // what a reference refers to
  };

  bool Fail(const xml_node& at, const std::string& found, std::string_view expected) {
    return source_.Fail(at, found, expected);
  }

  bool ReadDocument(const xml_node& root) {
    if (LocalName(root) != "pnml") {
      return Fail(root, "<" + std::string(root.name()) + ">", "the root element <pnml>");
    }
    std::vector<xml_node> found;
    std::string ids;
    for (const xml_node& child : root.children()) {
      if (LocalName(child) == "net") {
        found.push_back(child);
        ids += (ids.empty() ? "" : ", ") + IdOf(child);
      }
    }
    if (found.size() != 1) {
      return Fail(found.empty() ? root : found[1],
                  std::to_string(found.size()) + " nets" + (ids.empty() ? "" : ": " + ids), "one");
    }
    return ReadNet(found[0]);
  }

  bool ReadNet(const xml_node& net) {
    const std::string_view type = net.attribute("type").value();
    if (!IsPtNetType(type)) {
      return Fail(net,
                  type.empty() ? "a net without a type"
                               : "a net of the type " + Quoted(type, kMaxShownType),
                  "a P/T net: " + std::string(kPtNetType));
    }
    const xml_node label = FindChild(net, "name");
    net_.name = label ? LabelText(label) : net.attribute("id").value();
    if (!AddId(net, {.element = net}) || !CollectPage(net, 0) || !ReadNetProperties(net)) {
      return false;
    }
    CheckArcIds();
    return std::all_of(arcs_.begin(), arcs_.end(),
                       [this](const xml_node& arc) { return ReadArc(arc); });
  }

  bool ReadNetProperties(const xml_node& net) {
    const xml_node own = OwnData(net);
    if (!CheckVersion(own)) {
      return false;
    }
    const xml_node properties = FindChild(own, "properties");
    net_.name = ReadAttribute(properties, "name").value_or(net_.name);
    for (const xml_node& child : own.children()) {
      if (LocalName(child) == "claim") {
        net_.claims.push_back({.id = ReadAttribute(child, "identifier").value_or(""),
                               .text = ReadAttribute(child, "text").value_or("")});
      }
    }
    return true;
  }

  bool CheckVersion(const xml_node& own) {
    const std::string_view version = own.attribute("version").value();
    return !own || version == kPnmlToolVersion ||
           Fail(own, "<toolspecific> of version " + Quoted(version),
                "version " + std::string(kPnmlToolVersion));
  }

  // What is on a page; PIPE and TAPAAL write it into the net directly.
  bool CollectPage(const xml_node& page, size_t depth) {
    if (depth > kMaxDepth) {
      return Fail(page, "pages nested too deep", "at most " + std::to_string(kMaxDepth));
    }
    return std::all_of(page.begin(), page.end(),
                       [&](const xml_node& child) { return Collect(child, depth); });
  }

  bool Collect(const xml_node& child, size_t depth) {
    const std::string_view name = LocalName(child);
    Node node{.element = child};
    if (name == "page") {
      return AddId(child, node) && CollectPage(child, depth + 1);
    }
    if (name == "arc" || name == "inhibitorArc" || name == "inputArc" || name == "outputArc" ||
        name == "transportArc") {
      if (name != "arc") {
        return Fail(child, "<" + std::string(name) + ">", "<arc>");
      }
      arcs_.push_back(child);
      return true;
    }
    if (name == "place") {
      node.kind = Node::Kind::kPlace;
      node.index = static_cast<uint32_t>(net_.places.size());
      return AddId(child, node) && ReadPlace(child);
    }
    if (name == "transition") {
      node.kind = Node::Kind::kTransition;
      node.index = static_cast<uint32_t>(net_.transitions.size());
      return AddId(child, node) && ReadTransition(child);
    }
    if (name == "referencePlace" || name == "referenceTransition") {
      node.ref = child.attribute("ref").value();
      return AddId(child, node);
    }
    return true;
  }

  // Nothing refers to an arc: editors such as WoPeD, which give an ID twice, do no harm.
  void CheckArcIds() {
    std::unordered_set<std::string_view> ids;
    size_t repeated = 0;
    std::string_view first;
    for (const xml_node& arc : arcs_) {
      const std::string_view id = arc.attribute("id").value();
      if (!id.empty() && (nodes_.count(id) > 0 || !ids.insert(id).second)) {
        first = repeated++ == 0 ? id : first;
      }
    }
    if (repeated > 0) {
      warning_ = std::string(name_) + ": " + std::to_string(repeated) +
                 (repeated == 1 ? " arc has" : " arcs have") +
                 " the ID of another element, such as " + Quoted(first) +
                 ": each is an arc of its own";
    }
  }

  bool AddId(const xml_node& element, const Node& node) {
    const std::string_view id = element.attribute("id").value();
    if (id.empty()) {
      return Fail(element, "<" + std::string(element.name()) + "> without an ID",
                  "an attribute id");
    }
    const auto [first, is_new] = nodes_.emplace(id, node);
    return is_new || Fail(element, "the ID " + Quoted(id) + " of another element",
                          "one that is unique in the document");
  }

  static std::string IdOf(const xml_node& element) {
    return Quoted(element.attribute("id").value());
  }

  template <typename Node>
  bool ReadProperties(const xml_node& element, Node* node) {
    const xml_node own = OwnData(element);
    if (!CheckVersion(own)) {
      return false;
    }
    const xml_node properties = FindChild(own, "properties");
    node->id = ReadAttribute(properties, "identifier").value_or(element.attribute("id").value());
    node->name = ReadAttribute(properties, "name").value_or(LabelText(FindChild(element, "name")));
    node->owner = ReadAttribute(properties, "owner").value_or("");
    node->tag = ReadAttribute(properties, "tag").value_or("");
    node->does = ReadAttribute(properties, "does").value_or("");
    if constexpr (std::is_same_v<Node, Place>) {
      node->box = ReadAttribute(properties, "box").value_or("");
    }
    return true;
  }

  bool ReadPlace(const xml_node& element) {
    Place place;
    if (const std::string capacity = LabelText(FindChild(element, "capacity"));
        !capacity.empty() && capacity != "0") {
      return Fail(element, "place " + IdOf(element) + " with the capacity " + Quoted(capacity),
                  "places without a capacity");
    }
    if (const char* invariant = element.attribute("invariant").value(); !IsFreeOfTime(invariant)) {
      return Fail(element, "place " + IdOf(element) + " with the invariant " + Quoted(invariant),
                  "a net without time");
    }
    std::string marking = LabelText(FindChild(element, "initialMarking"));
    if (marking.empty()) {
      marking = element.attribute("initialMarking").value();
    }
    const std::optional<uint32_t> tokens = marking.empty() ? 0 : ParseCount(marking);
    if (!tokens) {
      return Fail(element,
                  "place " + IdOf(element) + " with the initial marking " + Quoted(marking),
                  "0 to " + std::to_string(petri::kMaxTokens) + " tokens of one kind");
    }
    place.tokens = *tokens;
    const bool ok = ReadProperties(element, &place);
    net_.places.push_back(std::move(place));
    return ok;
  }

  bool ReadTransition(const xml_node& element) {
    const auto with = [&](const std::string& what) {
      return "transition " + IdOf(element) + " with the " + what;
    };
    if (const std::string guard = GuardOf(element); !guard.empty()) {
      return Fail(element, with("guard " + Quoted(guard)), "a net without guards");
    }
    if (const std::string time = TimeOf(element); !time.empty()) {
      return Fail(element, with("time " + Quoted(time)), "a net without time");
    }
    const std::string priority = PriorityOf(element);
    if (net_.transitions.empty()) {
      first_transition_ = element;
    } else if (const std::string first = PriorityOf(first_transition_); priority != first) {
      const auto words = [](const std::string& text) {
        return text.empty() ? std::string("no priority") : text;
      };
      return Fail(element,
                  "transition " + IdOf(element) + " (" + words(priority) + ") beside " +
                      IdOf(first_transition_) + " (" + words(first) + ")",
                  "a net without priorities: the same of all transitions");
    }
    net_.transitions.emplace_back();
    return ReadProperties(element, &net_.transitions.back());
  }

  // The place or transition at an end of an arc, behind references.
  const Node* Resolve(const xml_node& arc, const char* end) {
    const std::string_view id = arc.attribute(end).value();
    auto found = nodes_.find(id);
    size_t followed = 0;
    while (found != nodes_.end() && !found->second.ref.empty()) {
      if (++followed > kMaxReferences) {
        Fail(found->second.element, "references that form a cycle at " + Quoted(found->first),
             "a place or transition after at most " + std::to_string(kMaxReferences));
        return nullptr;
      }
      const xml_node reference = found->second.element;
      found = nodes_.find(found->second.ref);
      const bool is_same_kind =
          found != nodes_.end() && (LocalName(found->second.element) == LocalName(reference) ||
                                    found->second.kind == (LocalName(reference) == "referencePlace"
                                                               ? Node::Kind::kPlace
                                                               : Node::Kind::kTransition));
      if (!is_same_kind) {
        Fail(reference,
             "<" + std::string(LocalName(reference)) + "> " + IdOf(reference) + " of " +
                 Quoted(reference.attribute("ref").value()),
             LocalName(reference) == "referencePlace" ? "the ID of a place"
                                                      : "the ID of a transition");
        return nullptr;
      }
    }
    if (found == nodes_.end() || found->second.kind == Node::Kind::kOther) {
      Fail(arc, "arc " + IdOf(arc) + " with the " + end + " " + Quoted(id),
           "the ID of a place or transition");
      return nullptr;
    }
    return &found->second;
  }

  bool ReadKind(const xml_node& arc, PnmlArcKind* kind) {
    for (const std::string& word : ArcKindWords(arc)) {
      const std::optional<PnmlArcKind> known = ArcKindOf(word);
      if (!known) {
        return Fail(arc, "arc " + IdOf(arc) + " of the kind " + Quoted(word), kPnmlArcKinds);
      }
      if (*known != PnmlArcKind::kNormal && *kind != PnmlArcKind::kNormal && *known != *kind) {
        return Fail(arc, "arc " + IdOf(arc) + " of two kinds", "one of them");
      }
      *kind = *known == PnmlArcKind::kNormal ? *kind : *known;
    }
    return true;
  }

  bool ReadWeight(const xml_node& arc, uint32_t* weight) {
    std::string text = LabelText(FindChild(arc, "inscription"));
    if (text.empty()) {
      text = arc.attribute("weight").value();
    }
    if (const std::string_view inscription = arc.attribute("inscription").value();
        inscription.starts_with('[') || inscription.starts_with('(')) {
      if (!IsFreeOfTime(inscription)) {
        return Fail(arc, "arc " + IdOf(arc) + " with the interval " + Quoted(inscription),
                    "a net without time");
      }
    } else if (text.empty()) {
      text = inscription;
    }
    const std::optional<uint32_t> number = text.empty() ? 1 : ParseCount(text);
    if (!number || *number == 0) {
      return Fail(arc, "arc " + IdOf(arc) + " with the weight " + Quoted(text),
                  "1 to " + std::to_string(petri::kMaxTokens));
    }
    *weight = *number;
    return true;
  }

  bool ReadArc(const xml_node& arc) {
    PnmlArcKind kind = PnmlArcKind::kNormal;
    uint32_t weight = 1;
    const Node* source = Resolve(arc, "source");
    const Node* target = source == nullptr ? nullptr : Resolve(arc, "target");
    if (target == nullptr || !ReadKind(arc, &kind) || !ReadWeight(arc, &weight)) {
      return false;
    }
    const bool from_place = source->kind == Node::Kind::kPlace;
    if (source->kind == target->kind || (kind != PnmlArcKind::kNormal && !from_place)) {
      return Fail(arc,
                  "arc " + IdOf(arc) + " from a " + (from_place ? "place" : "transition") +
                      " to a " + (target->kind == Node::Kind::kPlace ? "place" : "transition"),
                  kind == PnmlArcKind::kNormal ? "one of each" : "a place to a transition");
    }
    const uint32_t place = from_place ? source->index : target->index;
    Transition& transition = net_.transitions[from_place ? target->index : source->index];
    if (kind == PnmlArcKind::kRead) {
      return AddArc(arc, &transition.reads, place, weight, kind);
    }
    if (kind == PnmlArcKind::kInhibitor) {
      return AddArc(arc, &transition.inhibitors, place, weight, kind);
    }
    return AddArc(arc, from_place ? &transition.takes : &transition.gives, place, weight, kind);
  }

  bool AddArc(const xml_node& element, std::vector<Arc>* arcs, uint32_t place, uint32_t weight,
              PnmlArcKind kind) {
    size_t& at = arc_at_[{arcs, place}];  // 1 + its index
    if (at == 0) {
      arcs->push_back({place, weight});
      at = arcs->size();
      return true;
    }
    uint32_t& known = (*arcs)[at - 1].weight;
    if (kind == PnmlArcKind::kNormal && known + weight > petri::kMaxTokens) {
      return Fail(element,
                  "arc " + IdOf(element) + ", with which parallel ones have the weight " +
                      std::to_string(known + weight),
                  "at most " + std::to_string(petri::kMaxTokens));
    }
    known = kind == PnmlArcKind::kNormal ? known + weight
            : kind == PnmlArcKind::kRead ? std::max(known, weight)
                                         : std::min(known, weight);
    return true;
  }

  struct ArcKeyHash {
    size_t operator()(const std::pair<std::vector<Arc>*, uint32_t>& key) const {
      return std::hash<std::vector<Arc>*>()(key.first) * 1'000'003u ^ key.second;
    }
  };

  std::string_view name_;
  PnmlSource source_;
  Net net_;
  std::string warning_;
  xml_node first_transition_;
  std::unordered_map<std::string_view, Node> nodes_;  // of all IDs
  std::vector<xml_node> arcs_;
  std::unordered_map<std::pair<std::vector<Arc>*, uint32_t>, size_t, ArcKeyHash> arc_at_;
};

}  // namespace

Result<Net> ParsePnml(std::string_view name, std::string_view text, std::string* warning) {
  try {
    return PnmlReader(name, text).Read(warning);
  } catch (const std::exception& error) {  // such as no memory
    return AtLine(name, 1, 0, error.what());
  }
}

}  // namespace pheromone::nets
