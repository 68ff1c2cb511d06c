#include "server/core/petri/live_rules.h"

#include <algorithm>
#include <set>
#include <utility>

#include "server/core/petri/net.h"

namespace pheromone::petri {
namespace {

constexpr std::string_view kActions[] = {"present",  "pass",    "leave",   "choose A",
                                         "choose B", "store A", "store B", "take"};

struct Condition {
  std::string_view does;
  LiveRules::When when;
  Advice what;
};
constexpr Condition kConditions[] = {
    {"", LiveRules::When::kEnabled, Advice::kAny},
    {"add A", LiveRules::When::kAdd, Advice::kA},
    {"add B", LiveRules::When::kAdd, Advice::kB},
    {"advise 00", LiveRules::When::kAdvise, Advice::kAny},
    {"advise 01", LiveRules::When::kAdvise, Advice::kA},
    {"advise 10", LiveRules::When::kAdvise, Advice::kB},
    {"advise 00 anew", LiveRules::When::kAdviseAnew, Advice::kAny},
    {"advise 01 anew", LiveRules::When::kAdviseAnew, Advice::kA},
    {"advise 10 anew", LiveRules::When::kAdviseAnew, Advice::kB},
};

constexpr std::string_view kGreen = "green";
constexpr std::string_view kAdviceA = "advice 01";
constexpr std::string_view kAdviceB = "advice 10";

bool IsShown(const Place& place) {
  return place.does == kGreen || place.does == kAdviceA || place.does == kAdviceB;
}

// Notes the first thing that is wrong.
class Maker {
 public:
  explicit Maker(const LiveSettings& settings) : settings_(settings) {
    rules_.settings = settings;
    rules_.tags.resize(settings.tags.size());
  }

  Result<std::shared_ptr<const LiveRules>> Make() {
    const Status valid = CheckNet(settings_.net);
    wrong_ = valid.ErrorOr("");
    CheckSizes();
    CheckTags();
    for (uint32_t i = 0; wrong_.empty() && i < settings_.net.places.size(); ++i) {
      AddPlace(i);
    }
    for (uint32_t i = 0; wrong_.empty() && i < settings_.net.transitions.size(); ++i) {
      AddTransition(i);
    }
    if (!has_action_) {
      Note("no transition of a robot does anything, expected present, take or another one");
    }
    if (!wrong_.empty()) {
      return Error{"net \"" + settings_.name + "\": " + wrong_};
    }
    return std::make_shared<const LiveRules>(std::move(rules_));
  }

 private:
  void Note(std::string text) {
    if (wrong_.empty()) {
      wrong_ = std::move(text);
    }
  }

  void CheckSizes() {
    const auto check = [&](std::string_view what, size_t count, size_t most) {
      if (count > most) {
        Note(std::to_string(count) + " " + std::string(what) + ", expected " +
             std::to_string(most) + " at most");
      }
    };
    check("places", settings_.net.places.size(), kMaxLiveNodes);
    check("transitions", settings_.net.transitions.size(), kMaxLiveNodes);
    check("tags", settings_.tags.size(), kMaxLiveTags);
  }

  void CheckTags() {
    std::set<std::string_view> in_net;
    std::set<std::string_view> tags;
    for (const LiveTag& it : settings_.tags) {
      if (!in_net.insert(it.in_net).second || !tags.insert(it.tag).second) {
        Note("tag \"" + it.in_net + "\" or \"" + it.tag + "\" is bound twice");
      }
      if (it.candidates.size() > kMaxTriggers) {
        Note("tag \"" + it.in_net + "\" fires " + std::to_string(it.candidates.size()) +
             " transitions of the robots' net, expected " + std::to_string(kMaxTriggers) +
             " at most");
      }
      const auto is_rising = [&](uint8_t one, uint8_t next) { return one >= next; };
      if (std::adjacent_find(it.candidates.begin(), it.candidates.end(), is_rising) !=
              it.candidates.end() ||
          (!it.candidates.empty() && it.candidates.front() == 0)) {
        Note("tag \"" + it.in_net + "\": expected transitions in rising order, from 1 on");
      }
    }
  }

  LiveRules::AtTag* TagOf(const std::string& what, const std::string& tag) {
    for (size_t i = 0; i < settings_.tags.size(); ++i) {
      if (settings_.tags[i].in_net == tag) {
        return &rules_.tags[i];
      }
    }
    Note(what + (tag.empty() ? ": expected a tag" : ": tag \"" + tag + "\" is not bound"));
    return nullptr;
  }

  void AddPlace(uint32_t number) {
    const Place& place = settings_.net.places[number];
    if (place.does.empty()) {
      return;
    }
    const std::string what = "place \"" + place.id + "\"";
    if (!IsShown(place)) {
      Note(what + ": does: found \"" + place.does + "\", expected green, advice 01 or advice 10");
      return;
    }
    LiveRules::AtTag* const tag = TagOf(what, place.tag);
    if (tag == nullptr) {
      return;
    }
    std::optional<uint32_t>& it = place.does == kGreen ? tag->green
                                  : place.does == kAdviceA
                                      ? rules_.advice[static_cast<size_t>(Advice::kA)]
                                      : rules_.advice[static_cast<size_t>(Advice::kB)];
    tag->has_advice |= place.does != kGreen;
    if (it) {
      Note(what + ": place \"" + settings_.net.places[*it].id + "\" already is \"" + place.does +
           "\"");
    }
    it = number;
  }

  void AddTransition(uint32_t number) {
    const Transition& transition = settings_.net.transitions[number];
    const std::string what = "transition \"" + transition.id + "\"";
    if (transition.owner == "robot") {
      AddRobots(what, transition, number);
    } else if (transition.owner == "environment") {
      AddEnvironments(what, transition, number);
    } else {
      Note(what + ": owner: found \"" + transition.owner + "\", expected robot or environment");
    }
  }

  void AddRobots(const std::string& what, const Transition& transition, uint32_t number) {
    LiveRules::AtTag* const tag = TagOf(what, transition.tag);
    if (tag == nullptr) {
      return;
    }
    if (transition.does.empty()) {
      tag->silent.push_back(number);
      return;
    }
    const auto* const action = std::find(std::begin(kActions), std::end(kActions), transition.does);
    if (action == std::end(kActions)) {
      Note(what + ": does: found \"" + transition.does +
           "\", expected present, pass, leave, choose A, choose B, store A, store B or take, as a "
           "robot does");
      return;
    }
    tag->by_action[static_cast<size_t>(action - std::begin(kActions)) + 1].push_back(number);
    tag->has_source |= transition.does == NameOf(LiveAction::kTake);
    has_action_ = true;
  }

  void AddEnvironments(const std::string& what, const Transition& transition, uint32_t number) {
    const auto* const found =
        std::find_if(std::begin(kConditions), std::end(kConditions),
                     [&](const Condition& it) { return it.does == transition.does; });
    if (found == std::end(kConditions)) {
      Note(what + ": does: found \"" + transition.does +
           "\", expected add A, add B, or advise 00, 01 or 10 with or without anew, as the "
           "environment does");
      return;
    }
    rules_.environment.push_back({number, found->when, found->what});
    rules_.advises_anew |= found->when == LiveRules::When::kAdviseAnew;
  }

  const LiveSettings& settings_;
  LiveRules rules_;
  std::string wrong_;
  bool has_action_ = false;
};

}  // namespace

std::string_view NameOf(LiveAction action) {
  return kActions[static_cast<size_t>(action) - 1];
}

bool LiveSettings::SameNet(const LiveSettings& other) const {
  const auto same_tag = [](const LiveTag& one, const LiveTag& another) {
    return one.in_net == another.in_net;
  };
  return net == other.net && robot_hash == other.robot_hash &&
         std::equal(tags.begin(), tags.end(), other.tags.begin(), other.tags.end(), same_tag);
}

Result<std::shared_ptr<const LiveRules>> MakeLiveRules(const LiveSettings& settings) {
  return Maker(settings).Make();
}

std::vector<std::string> LiveTagsOf(const Net& net) {
  std::vector<std::string> tags;
  const auto add = [&](const std::string& tag) {
    if (!tag.empty() && std::find(tags.begin(), tags.end(), tag) == tags.end()) {
      tags.push_back(tag);
    }
  };
  for (const Transition& transition : net.transitions) {
    if (transition.owner == "robot") {
      add(transition.tag);
    }
  }
  for (const Place& place : net.places) {
    if (IsShown(place)) {
      add(place.tag);
    }
  }
  return tags;
}

}  // namespace pheromone::petri
