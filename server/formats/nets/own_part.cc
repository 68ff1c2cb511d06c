#include "server/formats/nets/own_part.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace pheromone::nets {
namespace {

constexpr int64_t kMaxParameter = petri::kMaxTokens;

// A long claim may be written on several lines.
std::string OnOneLine(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const bool space = c == ' ' || c == '\n' || c == '\r' || c == '\t';
    if (!space || (!line.empty() && line.back() != ' ')) {
      line += space ? ' ' : c;
    }
  }
  return line;
}

class OwnReader {
 public:
  explicit OwnReader(const Keys& file) : file_(file) {}

  OwnPart Read() && {
    if (const auto net = file_.Table("net")) {
      net->AllowOnly({"name"});
      part_.net.name = net->Required("name", "the net's name");
    } else if (!file_.Has("net")) {
      file_.Note("net", "missing, expected a table [net] with a name");
    }
    for (const Keys& table : file_.Tables("place")) {
      ReadPlace(table);
    }
    for (const Keys& table : file_.Tables("transition")) {
      ReadTransition(table);
    }
    for (const Keys& table : file_.Tables("claim")) {
      table.AllowOnly({"id", "text"});
      petri::Claim claim{.id = table.Id(), .text = OnOneLine(table.Required("text", "a claim"))};
      if (!claim_ids_.insert(claim.id).second) {
        table.Note("id", "found \"" + claim.id + "\" twice, expected another name");
      }
      part_.net.claims.push_back(std::move(claim));
    }
    return std::move(part_);
  }

 private:
  // True if there is room for one more, and its ID is new.
  bool IsNew(const Keys& table, const std::string& id, size_t count) {
    if (count >= petri::kMaxNodes) {
      table.Note("", "expected at most " + std::to_string(petri::kMaxNodes));
      return false;
    }
    if (!node_ids_.insert(id).second) {
      table.Note("id", "found \"" + id + "\" twice, expected another name");
      return false;
    }
    return true;
  }

  void ReadPlace(const Keys& table) {
    table.AllowOnly({"id", "name", "tokens", "box", "owner", "tag", "does"});
    petri::Place place{
        .id = table.Id(),
        .name = table.Text("name"),
        .tokens = static_cast<uint32_t>(table.Number("tokens", 0, petri::kMaxTokens, 0)),
        .box = table.Text("box"),
        .owner = table.Text("owner"),
        .tag = table.Text("tag"),
        .does = table.Text("does")};
    if (!place.box.empty() && !IsPlainId(place.box)) {
      table.Note("box", "found \"" + place.box + "\", expected letters, digits, _ . and -");
    }
    if (!place.id.empty() && IsNew(table, place.id, part_.net.places.size())) {
      numbers_[place.id] = static_cast<uint32_t>(part_.net.places.size());
      part_.net.places.push_back(std::move(place));
    }
  }

  void ReadTransition(const Keys& table) {
    table.AllowOnly(
        {"id", "name", "takes", "gives", "reads", "inhibited_by", "owner", "tag", "does"});
    petri::Transition transition{.id = table.Id(),
                                 .name = table.Text("name"),
                                 .takes = ReadArcs(table, "takes"),
                                 .gives = ReadArcs(table, "gives"),
                                 .reads = ReadArcs(table, "reads"),
                                 .inhibitors = ReadArcs(table, "inhibited_by"),
                                 .owner = table.Text("owner"),
                                 .tag = table.Text("tag"),
                                 .does = table.Text("does")};
    if (!transition.id.empty() && IsNew(table, transition.id, part_.net.transitions.size())) {
      part_.net.transitions.push_back(std::move(transition));
    }
  }

  std::vector<petri::Arc> ReadArcs(const Keys& table, std::string_view key) {
    std::vector<petri::Arc> arcs;
    std::unordered_set<uint32_t> seen;
    for (const Located& arc : table.Texts(key)) {
      const size_t space = arc.text.rfind(' ');
      const std::string id = space == std::string::npos ? arc.text : arc.text.substr(space + 1);
      const int64_t weight = space == std::string::npos ? 1 : WeightOf(arc.text.substr(0, space));
      if (weight == 0 || !IsPlainId(id)) {
        table.NoteAt(arc.at, key,
                     "found \"" + arc.text + "\", expected a place, or a number from 1 to " +
                         std::to_string(petri::kMaxTokens) + " and a place: \"2 place\"");
        continue;
      }
      const uint32_t place = NumberOf(id, arc);
      if (!seen.insert(place).second) {
        table.NoteAt(arc.at, key,
                     "found \"" + id + "\" twice, expected one arc with the sum of the weights");
        continue;
      }
      arcs.push_back({place, static_cast<uint32_t>(weight)});
    }
    return arcs;
  }

  // 0 if it is none.
  static int64_t WeightOf(std::string_view text) {
    int64_t weight = 0;
    for (const char c : text) {
      if (c < '0' || c > '9' || weight > petri::kMaxTokens) {
        return 0;
      }
      weight = weight * 10 + (c - '0');
    }
    return weight > petri::kMaxTokens ? 0 : weight;
  }

  uint32_t NumberOf(const std::string& id, const Located& arc) {
    const auto [found, is_new] =
        numbers_.try_emplace(id, static_cast<uint32_t>(part_.net.places.size()));
    if (is_new) {
      part_.net.places.push_back({.id = id});
      part_.foreign.push_back({id, arc.at});
    }
    return found->second;
  }

  const Keys& file_;
  OwnPart part_{};
  std::unordered_map<std::string, uint32_t> numbers_{};
  std::unordered_set<std::string> node_ids_{};
  std::unordered_set<std::string> claim_ids_{};
};

struct Declared {
  int64_t value = 0;
  int64_t least = 0;
  int64_t most = kMaxParameter;
};

Declared ReadDeclared(const Keys& table, const std::string& name) {
  Declared declared;
  if (table.IsTable(name)) {
    const Keys keys = *table.Table(name);
    keys.AllowOnly({"value", "least", "most"});
    declared.least = keys.Number("least", 0, kMaxParameter, 0);
    declared.most = keys.Number("most", declared.least, kMaxParameter, kMaxParameter);
    declared.value = keys.Number("value", declared.least, declared.most, std::nullopt);
  } else {
    declared.value = table.Number(name, declared.least, declared.most, std::nullopt);
  }
  return declared;
}

}  // namespace

Parameters ReadParameters(const Keys& file, const Parameters& chosen) {
  Parameters parameters;
  if (const auto table = file.Table("parameters")) {
    for (const std::string& name : table->Names()) {
      const Declared declared = ReadDeclared(*table, name);
      const auto found = chosen.find(name);
      parameters[name] = found == chosen.end() ? declared.value : found->second;
      if (parameters[name] < declared.least || parameters[name] > declared.most) {
        table->Note(name, "chosen as " + std::to_string(parameters[name]) + ", expected " +
                              std::to_string(declared.least) + " to " +
                              std::to_string(declared.most));
      }
      if (!IsPlainId(name) || name == "as" || name.find('-') != std::string::npos) {
        table->Note(name, "expected a name of letters, digits, _ and . other than \"as\"");
      }
    }
  }
  for (const auto& [name, value] : chosen) {
    if (!parameters.contains(name)) {
      file.Note("parameters", "\"" + name + "\" is chosen as " + std::to_string(value) +
                                  ", expected one of " + NamesOf(parameters));
    }
  }
  return parameters;
}

OwnPart ReadOwnPart(const Keys& file) {
  return OwnReader(file).Read();
}

}  // namespace pheromone::nets
