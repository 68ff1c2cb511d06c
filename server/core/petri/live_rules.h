// A composed net that is executed: which of its transitions are robots' and which the
// environment's, and what they do beside moving tokens (the attribute `does`):
//
//   owner        does                fired
//   robot        present, pass,      when a robot says so at the transition's tag: the first one of
//                leave, choose A,    these that is enabled, in the order of the net
//                choose B, store A,
//                store B, take
//   robot        none                before one of those, if it enables it
//   environment  none                as soon as it is enabled
//   environment  add A, add B        likewise; the last deposit for that trail is added to it
//   environment  advise 00, 01, 10   likewise, if that is the advice by the concentrations
//   environment  advise .. anew      likewise, if it also differs from the one that is advised
//
// Of a place, `green` shows green at its tag while it is marked, `advice 01` and `advice 10` that
// advice; neither is 00.
//
//   Result<std::shared_ptr<const LiveRules>> rules = MakeLiveRules(settings);
//   LiveNet net(rules.value());          // live_net.h
//
// Plain values; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/fields.h"
#include "server/base/result.h"
#include "server/core/petri/evaporation.h"
#include "server/core/petri/net_data.h"

namespace pheromone::petri {

/// What robots say, with the numbers of protocol::NetAction.
enum class LiveAction : uint8_t {
  kPresent = 1,
  kPass = 2,
  kLeave = 3,
  kChooseA = 4,
  kChooseB = 5,
  kStoreA = 6,
  kStoreB = 7,
  kTake = 8,
};
constexpr LiveAction kLastLiveAction = LiveAction::kTake;
/// As `does` says it: "choose A".
std::string_view NameOf(LiveAction action);

constexpr size_t kMaxLiveNets = 16;
constexpr size_t kMaxLiveTags = 64;     ///< of a net
constexpr size_t kMaxLiveNodes = 4096;  ///< places, and transitions, of a net
constexpr size_t kMaxTriggers = 11;     ///< transitions of the robots' net at one tag

/// A tag of the net.
struct LiveTag {
  std::string in_net;                 ///< as the net calls it
  std::string tag;                    ///< the name of the virtual tag
  std::vector<uint8_t> candidates{};  ///< of the robots' net, from 1, rising: its trigger vector
  bool operator==(const LiveTag&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("in_net", it.in_net);
    visit("tag", it.tag);
    visit("candidates", it.candidates);
  }
};

struct LiveSettings {
  std::string name;
  Net net;
  uint32_t robot_hash = 0;  ///< of the robots' net
  std::vector<LiveTag> tags{};
  uint32_t period_ms = 200;
  EvaporationLaw law = EvaporationLaw::kE1;
  uint32_t rate_milli = 1000;
  uint32_t dead_band_milli = 0;
  bool has_source = false;  ///< whether the source can be emptied
  uint32_t source = 0;      ///< what it has at the beginning
  bool operator==(const LiveSettings&) const = default;

  Evaporation evaporation() const { return {law, rate_milli}; }
  /// Whether a running net can go on with these.
  bool SameNet(const LiveSettings& other) const;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("name", it.name);
    visit("net", it.net);
    visit("robot_hash", it.robot_hash);
    visit("tags", it.tags);
    visit("period_ms", it.period_ms, Within(kLeastPeriodMs, kMaxPeriodMs));
    visit("law", it.law, UpTo(kLastEvaporationLaw));
    visit("rate_milli", it.rate_milli, Within(0, kMaxRateMilli));
    visit("dead_band_milli", it.dead_band_milli, Within(0, kMaxConcentrationMilli));
    visit("has_source", it.has_source);
    visit("source", it.source);
  }

  static constexpr int64_t kLeastPeriodMs = 2;
  static constexpr int64_t kMaxPeriodMs = 60'000;
};

struct LiveRules {
  struct AtTag {
    std::array<std::vector<uint32_t>, static_cast<size_t>(kLastLiveAction) + 1> by_action{};
    std::vector<uint32_t> silent{};
    std::optional<uint32_t> green{};  ///< a place
    bool has_advice = false;
    bool has_source = false;
  };
  enum class When : uint8_t { kEnabled, kAdd, kAdvise, kAdviseAnew };
  struct Environment {
    uint32_t transition = 0;
    When when = When::kEnabled;
    Advice what = Advice::kAny;  ///< the trail that is added to; the advice
  };

  LiveSettings settings;
  std::vector<AtTag> tags{};                        ///< as in the settings
  std::vector<Environment> environment{};           ///< in the order of the net
  std::array<std::optional<uint32_t>, 3> advice{};  ///< places, by Advice; of kAny none
  bool advises_anew = false;
};

/// Errors: what CheckNet says; an owner, a `does` or a tag that is missing, unknown or there twice;
/// no transition for robots; sizes above those of this file.
Result<std::shared_ptr<const LiveRules>> MakeLiveRules(const LiveSettings& settings);

/// The tags of a net that robots or the environment's reader use, in the order of the net.
std::vector<std::string> LiveTagsOf(const Net& net);

}  // namespace pheromone::petri
