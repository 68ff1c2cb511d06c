#include "client_fw/lab/behaviours/kinds.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "client_fw/core/steering/settings.h"
#include "client_fw/lab/behaviours/follow.h"
#include "client_fw/lab/behaviours/forage.h"
#include "client_fw/lab/behaviours/walkers.h"

namespace pheromone::lab {
namespace {

constexpr double kMaxSpeed = client::kMaxSpeedMmS / 1000.0;
constexpr double kMaxQuanta = 255;  // of a message

class Reader {
 public:
  explicit Reader(const ParameterValues& values) : values_(values) {}

  double number(std::string_view name) const { return values_.find(name)->second; }
  double radians(std::string_view name) const { return number(name) * std::numbers::pi / 180; }
  uint16_t quanta() const { return static_cast<uint16_t>(number("quanta")); }
  int16_t mm_s() const { return static_cast<int16_t>(std::lround(number("speed_m_per_s") * 1000)); }
  template <typename Choice, size_t kChoices>
  Choice choice(std::string_view name, const Choice (&choices)[kChoices]) const {
    return choices[static_cast<size_t>(number(name))];
  }
  ExploreSettings walk() const {
    return {number("speed_m_per_s"), radians("wander_deg"), quanta()};
  }

 private:
  const ParameterValues& values_;
};

ParameterSpec Speed() {
  return {"speed_m_per_s", 0.02, kMaxSpeed, 0.2};
}

ParameterSpec Quanta(double fallback) {
  return {"quanta", 0, kMaxQuanta, fallback, true};
}

ParameterSpec Wander() {
  return {"wander_deg", 0, 180, 20};
}

std::shared_ptr<Behaviour> FollowFrom(const ParameterValues& values, size_t robots) {
  return MakeFollow(FollowSettings(values), Reader(values).quanta(), robots);
}

std::shared_ptr<Behaviour> ForageFrom(const ParameterValues& values, size_t /*robots*/) {
  static constexpr Homing kHoming[] = {Homing::kBearing, Homing::kPheromone};
  const Reader read(values);
  return MakeForage({.speed_m_s = read.number("speed_m_per_s"),
                     .wander_rad = read.radians("wander_deg"),
                     .quanta = read.quanta(),
                     .faintest = read.number("faintest"),
                     .homing = read.choice("home", kHoming),
                     .fade_s = read.number("fade_s"),
                     .ignore_s = read.number("ignore_s")});
}

std::shared_ptr<Behaviour> ExploreFrom(const ParameterValues& values, size_t /*robots*/) {
  return MakeExplore(Reader(values).walk());
}

std::shared_ptr<Behaviour> PatrolFrom(const ParameterValues& values, size_t /*robots*/) {
  const Reader read(values);
  return MakePatrol({read.walk(), read.number("gain")});
}

std::shared_ptr<Behaviour> AggregateFrom(const ParameterValues& values, size_t /*robots*/) {
  const Reader read(values);
  return MakeAggregate({read.walk(), read.number("wait_s"), read.number("half")});
}

ParameterSpec Gain() {
  return {"gain", 0.125, client::kMaxGain / 8.0, 1};
}

}  // namespace

client::Settings FollowSettings(const ParameterValues& values) {
  static constexpr client::Law kLaws[] = {client::Law::kCareful, client::Law::kDifferential,
                                          client::Law::kPaper, client::Law::kFuzzy};
  static constexpr client::LostTrail kLost[] = {
      client::LostTrail::kSearch, client::LostTrail::kStop, client::LostTrail::kStraight,
      client::LostTrail::kSpiral};
  const Reader read(values);
  client::Settings settings;
  settings.law = read.choice("law", kLaws);
  settings.lost_trail = read.choice("lost_trail", kLost);
  settings.speed_mm_s = read.mm_s();
  settings.gain_8ths = static_cast<uint8_t>(std::lround(read.number("gain") * client::kUnitGain));
  settings.lay_trail = read.quanta() > 0;
  return settings;
}

std::span<const BehaviourKind> BehaviourKinds() {
  static const std::vector<BehaviourKind> kinds = {
      {"follow",
       1,
       {Speed(),
        Quanta(0),
        Gain(),
        {"law", 0, 0, 0, false, {"careful", "differential", "paper", "fuzzy"}},
        {"lost_trail", 0, 0, 0, false, {"search", "stop", "straight", "spiral"}}},
       FollowFrom},
      {"forage",
       1,
       {Speed(),
        Quanta(1),
        Wander(),
        {"faintest", 0, 100, 0.01},
        {"home", 0, 0, 0, false, {"bearing", "pheromone"}},
        {"fade_s", 0, 1e6, 60},
        {"ignore_s", 0, 1e6, 20}},
       ForageFrom},
      {"patrol", 1, {Speed(), Quanta(1), Wander(), Gain()}, PatrolFrom},
      {"aggregate",
       1,
       {Speed(), Quanta(0), Wander(), {"wait_s", 0, 1e6, 60}, {"half", 1e-6, 1e6, 0.5}},
       AggregateFrom},
      {"explore", 0, {Speed(), Quanta(0), Wander()}, ExploreFrom},
  };
  return kinds;
}

ParameterValues DefaultsOf(const BehaviourKind& kind) {
  ParameterValues values;
  for (const ParameterSpec& spec : kind.parameters) {
    values.emplace(spec.name, spec.fallback);
  }
  return values;
}

}  // namespace pheromone::lab
