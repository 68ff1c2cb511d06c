// What a place/transition net consists of. What can be done with one is in net.h.
//
// Plain values; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace pheromone::petri {

inline constexpr uint32_t kMaxTokens = 1'000'000'000;
inline constexpr size_t kMaxNodes = 1'000'000;  ///< places, and transitions, of a net

/// What an arc joins a transition to.
struct Arc {
  uint32_t place = 0;
  uint32_t weight = 1;

  bool operator==(const Arc&) const = default;

  /// As in server/base/fields.h, here and below.
  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("place", it.place);
    visit("weight", it.weight);
  }
};

struct Place {
  std::string id;       ///< unique among places and transitions
  std::string name{};   ///< for people; may be empty
  uint32_t tokens = 0;  ///< initially
  std::string box{};    ///< a pseudo-box (Ferreira et al. 2018, section 4.1): its message's name
  std::string owner{};  ///< who fires what it feeds, such as "robot"; may be empty
  std::string tag{};    ///< where it is stored; may be empty
  std::string does{};   ///< what a robot does while it is marked; may be empty

  bool operator==(const Place&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("id", it.id);
    visit("name", it.name);
    visit("tokens", it.tokens);
    visit("box", it.box);
    visit("owner", it.owner);
    visit("tag", it.tag);
    visit("does", it.does);
  }
};

/// Enabled if all takes and reads have their tokens and no inhibitor has as many as its weight.
/// Each list names a place once at most.
struct Transition {
  std::string id;
  std::string name{};
  std::vector<Arc> takes{};
  std::vector<Arc> gives{};
  std::vector<Arc> reads{};
  std::vector<Arc> inhibitors{};
  std::string owner{};
  std::string tag{};
  std::string does{};  ///< what firing it does beside moving tokens; may be empty

  bool operator==(const Transition&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("id", it.id);
    visit("name", it.name);
    visit("takes", it.takes);
    visit("gives", it.gives);
    visit("reads", it.reads);
    visit("inhibitors", it.inhibitors);
    visit("owner", it.owner);
    visit("tag", it.tag);
    visit("does", it.does);
  }
};

/// What is claimed of a net: see property.h.
struct Claim {
  std::string id;
  std::string text;

  bool operator==(const Claim&) const = default;
};

struct Net {
  std::string name;
  std::vector<Place> places{};
  std::vector<Transition> transitions{};
  std::vector<Claim> claims{};

  bool operator==(const Net&) const = default;

  /// What is fired: without the claims.
  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("name", it.name);
    visit("places", it.places);
    visit("transitions", it.transitions);
  }
};

}  // namespace pheromone::petri
