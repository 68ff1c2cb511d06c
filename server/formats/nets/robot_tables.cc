#include "server/formats/nets/robot_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <map>
#include <optional>
#include <utility>

#include "protocol/net_record.h"

namespace pheromone::nets {
namespace {

using protocol::PlaceDoes;
using protocol::TransitionDoes;

constexpr uint8_t kMaxType = 15;  // TRACE and SENSE have four bits for it

struct TransitionWord {
  std::string_view text;
  TransitionDoes does;
  std::string_view constant;
};
constexpr std::array<TransitionWord, 8> kTransitionWords{{
    {"", TransitionDoes::kNothing, "kNothing"},
    {"present", TransitionDoes::kPresent, "kPresent"},
    {"leave", TransitionDoes::kLeave, "kLeave"},
    {"leave A", TransitionDoes::kLeaveA, "kLeaveA"},
    {"leave B", TransitionDoes::kLeaveB, "kLeaveB"},
    {"store A", TransitionDoes::kStoreA, "kStoreA"},
    {"store B", TransitionDoes::kStoreB, "kStoreB"},
    {"take", TransitionDoes::kTake, "kTake"},
}};

struct PlaceWord {
  std::string_view text;  // before the type
  PlaceDoes does;
  std::string_view constant;
  bool has_type;
};
constexpr std::array<PlaceWord, 4> kPlaceWords{{
    {"", PlaceDoes::kNothing, "kNothing", false},
    {"follow", PlaceDoes::kFollow, "kFollow", true},
    {"wait", PlaceDoes::kWait, "kWait", true},
    {"choose", PlaceDoes::kChoose, "kChoose", false},
}};

template <typename Words, typename Does>
const auto& WordOf(const Words& words, Does does) {
  return *std::find_if(words.begin(), words.end(), [&](const auto& it) { return it.does == does; });
}

// Notes the first thing that is wrong.
class Maker {
 public:
  explicit Maker(const petri::Net& net) : net_(net) {}

  Result<RobotTables> Make() {
    PHEROMONE_TRY_STATUS(petri::CheckNet(net_));
    robot_.name = net_.name;
    if (Fits("places", net_.places.size()) && Fits("transitions", net_.transitions.size())) {
      for (const petri::Place& place : net_.places) {
        AddPlace(place);
      }
      for (const petri::Transition& transition : net_.transitions) {
        AddTransition(transition);
      }
      if (wrong_.empty()) {
        CheckMeaning();
      }
    }
    if (!wrong_.empty()) {
      return Error{wrong_};
    }
    robot_.hash = Hash();
    return robot_;
  }

 private:
  void Note(std::string text) {
    if (wrong_.empty()) {
      wrong_ = std::move(text);
    }
  }

  bool Fits(std::string_view what, size_t count) {
    if (count == 0 || count > kMaxRobotNodes) {
      Note(fmt::format("found {} {}, expected 1 to {} in the net of a robot", count, what,
                       kMaxRobotNodes));
    }
    return wrong_.empty();
  }

  void AddPlace(const petri::Place& place) {
    if (place.tokens > 1) {
      Note(fmt::format("place \"{}\": tokens: found {}, expected 0 or 1", place.id, place.tokens));
    }
    robot_.marking |= (place.tokens != 0 ? 1U : 0U) << robot_.places.size();
    const std::string_view does = place.does;
    const size_t space = std::min(does.find(' '), does.size());
    for (const PlaceWord& word : kPlaceWords) {
      if (word.text != does.substr(0, space)) {
        continue;
      }
      unsigned type = 0;
      if (word.has_type && space != does.size()) {
        const std::string_view number = does.substr(space + 1);
        const char* const end = number.data() + number.size();
        const auto [parsed, code] = std::from_chars(number.data(), end, type);
        type = code == std::errc() && parsed == end && type <= kMaxType ? type : 0;
      }
      if (word.has_type ? type != 0 : space == does.size()) {
        robot_.places.push_back({place.id, word.does, static_cast<uint8_t>(type)});
        return;
      }
    }
    Note(
        fmt::format("place \"{}\": does: found \"{}\", expected \"follow T\", \"wait T\" or "
                    "\"choose\", with the line's pheromone type T, 1 to {}",
                    place.id, place.does, kMaxType));
    robot_.places.push_back({place.id});
  }

  uint32_t Mask(const petri::Transition& transition, const std::vector<petri::Arc>& arcs) {
    uint32_t mask = 0;
    for (const petri::Arc& arc : arcs) {
      if (arc.weight != 1) {
        Note(fmt::format("transition \"{}\": found an arc of weight {} to place \"{}\", expected 1",
                         transition.id, arc.weight, net_.places[arc.place].id));
      }
      mask |= 1U << arc.place;
    }
    return mask;
  }

  void AddTransition(const petri::Transition& transition) {
    RobotTransition row{.id = transition.id, .tag = transition.tag};
    const uint32_t reads = Mask(transition, transition.reads);
    row.takes = Mask(transition, transition.takes);
    row.gives = Mask(transition, transition.gives);
    row.inhibited_by = Mask(transition, transition.inhibitors);
    if ((reads & (row.takes | row.gives)) != 0) {
      Note(fmt::format("transition \"{}\" reads a place that it takes from or gives to",
                       transition.id));
    }
    row.takes |= reads;
    row.gives |= reads;
    const auto* const word =
        std::find_if(kTransitionWords.begin(), kTransitionWords.end(),
                     [&](const TransitionWord& it) { return it.text == transition.does; });
    if (word == kTransitionWords.end()) {
      Note(
          fmt::format("transition \"{}\": does: found \"{}\", expected present, leave, leave A, "
                      "leave B, store A, store B or take",
                      transition.id, transition.does));
    } else {
      row.does = word->does;
    }
    if (transition.tag.empty()) {
      Note(fmt::format("transition \"{}\": expected a tag, whose capture fires it", transition.id));
    } else if (const size_t count = ++of_tag_[transition.tag]; count > protocol::kMaxCandidates) {
      Note(fmt::format("tag \"{}\": found {} transitions, expected {} at most", transition.tag,
                       count, protocol::kMaxCandidates));
    }
    robot_.transitions.push_back(std::move(row));
  }

  // The only place of these that does something, if it is the only one.
  const RobotPlace* Doing(uint32_t places) const {
    const RobotPlace* doing = nullptr;
    for (size_t i = 0; i < robot_.places.size(); ++i) {
      if ((places >> i & 1) != 0 && robot_.places[i].does != PlaceDoes::kNothing) {
        if (doing != nullptr) {
          return nullptr;
        }
        doing = &robot_.places[i];
      }
    }
    return doing;
  }

  void CheckMeaning() {
    const RobotPlace* const first = Doing(robot_.marking);
    if (first == nullptr || first->does != PlaceDoes::kFollow) {
      Note(
          "of the places that are marked initially, expected exactly one that does something, "
          "and this \"follow T\"");
    }
    for (const RobotTransition& it : robot_.transitions) {
      CheckMeaning(it);
    }
    for (const RobotPlace& place : robot_.places) {
      if (place.does == PlaceDoes::kChoose) {
        CheckChoice(place);
      }
    }
  }

  void CheckMeaning(const RobotTransition& it) {
    const RobotPlace* const from = Doing(it.takes);
    const RobotPlace* const to = Doing(it.gives);
    if (from == nullptr || to == nullptr) {
      Note(
          fmt::format("transition \"{}\": expected that it takes from exactly one place that does "
                      "something, and gives to exactly one",
                      it.id));
      return;
    }
    const bool by_choice = it.does == TransitionDoes::kLeaveA || it.does == TransitionDoes::kLeaveB;
    if (by_choice != (from->does == PlaceDoes::kChoose)) {
      Note(
          fmt::format("transition \"{}\": expected \"leave A\" or \"leave B\" out of a place that "
                      "chooses, and only there; place \"{}\"",
                      it.id, from->id));
    }
    if ((it.does == TransitionDoes::kPresent) != (to->does == PlaceDoes::kWait)) {
      Note(
          fmt::format("transition \"{}\": expected \"present\" into a place that waits, and only "
                      "there; place \"{}\"",
                      it.id, to->id));
    }
    if (to->does == PlaceDoes::kChoose && it.does != TransitionDoes::kNothing) {
      Note(fmt::format("transition \"{}\": does: expected nothing, as place \"{}\" chooses", it.id,
                       to->id));
    }
  }

  // One way out for each trail, and lines to follow there.
  void CheckChoice(const RobotPlace& place) {
    for (const TransitionDoes does : {TransitionDoes::kLeaveA, TransitionDoes::kLeaveB}) {
      const auto leads = [&](const RobotTransition& it) {
        return it.does == does && Doing(it.takes) == &place;
      };
      if (std::count_if(robot_.transitions.begin(), robot_.transitions.end(), leads) != 1) {
        Note(fmt::format("place \"{}\" chooses: expected one transition out of it that does \"{}\"",
                         place.id, WordOf(kTransitionWords, does).text));
      }
    }
  }

  uint32_t Hash() const {
    protocol::NetHasher hash;
    hash.AddByte(static_cast<uint8_t>(robot_.places.size()));
    hash.AddByte(static_cast<uint8_t>(robot_.transitions.size()));
    hash.AddWord(robot_.marking);
    for (const RobotPlace& place : robot_.places) {
      hash.AddByte(static_cast<uint8_t>(place.does));
      hash.AddByte(place.type);
    }
    for (const RobotTransition& it : robot_.transitions) {
      hash.AddWord(it.takes);
      hash.AddWord(it.gives);
      hash.AddWord(it.inhibited_by);
      hash.AddByte(static_cast<uint8_t>(it.does));
    }
    return hash.value();
  }

  const petri::Net& net_;
  RobotTables robot_;
  std::map<std::string, size_t> of_tag_;
  std::string wrong_;
};

// In a comment that ends with its line.
std::string LineComment(std::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\\' || static_cast<uint8_t>(c) < ' '; },
      '_');
  return line;
}

}  // namespace

std::vector<uint8_t> RobotTables::CandidatesOf(std::string_view tag) const {
  std::vector<uint8_t> candidates;
  for (size_t i = 0; i < transitions.size(); ++i) {
    if (transitions[i].tag == tag) {
      candidates.push_back(static_cast<uint8_t>(i + 1));
    }
  }
  return candidates;
}

Result<RobotTables> MakeRobotTables(const petri::Net& net) {
  return Maker(net).Make();
}

std::string HeaderOf(const RobotTables& robot, std::string_view source) {
  std::string text = fmt::format(
      "// The net \"{}\", made by pheromonectl net tables {}; see net_tables.h.\n"
      "#pragma once\n\n"
      "#include \"client_fw/core/tasks/net_tables.h\"\n\n"
      "// clang-format off\n"
      "namespace pheromone {{\n"
      "namespace client {{\n\n"
      "constexpr NetPlaceRow kRobotPlaces[] = {{\n",
      LineComment(robot.name), LineComment(source));
  for (const RobotPlace& place : robot.places) {
    text +=
        fmt::format("    {{protocol::PlaceDoes::{}, {}}},  // {}\n",
                    WordOf(kPlaceWords, place.does).constant, place.type, LineComment(place.id));
  }
  text += "};\n\nconstexpr NetTransitionRow kRobotTransitions[] = {\n";
  for (const RobotTransition& it : robot.transitions) {
    text += fmt::format(
        "    {{{{{:#010x}, {:#010x}, {:#010x}}}, protocol::TransitionDoes::{}}},  // {} at {}\n",
        it.takes, it.gives, it.inhibited_by, WordOf(kTransitionWords, it.does).constant,
        LineComment(it.id), LineComment(it.tag));
  }
  text += fmt::format(
      "}};\n\nconstexpr NetTables kRobotNet = {{{:#010x}, {:#010x}, kRobotPlaces, "
      "kRobotTransitions, {}, {}}};\n\n"
      "}}  // namespace client\n"
      "}}  // namespace pheromone\n"
      "// clang-format on\n",
      robot.hash, robot.marking, robot.places.size(), robot.transitions.size());
  return text;
}

}  // namespace pheromone::nets
