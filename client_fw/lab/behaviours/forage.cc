#include "client_fw/lab/behaviours/forage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "client_fw/lab/behaviours/walk.h"

namespace pheromone::lab {
namespace {

// Beyond the nest by this much, a robot on a trail that heads home turns round.
constexpr double kNearNestM = 0.5;
constexpr double kHeadsHome = -0.3;  // the cosine between its heading and the way out
// The rest of a robot's memory.
constexpr size_t kLeftNest = kIgnore + 1;  // the step in which it was at a nest last

class ForageBehaviour : public Behaviour {
 public:
  explicit ForageBehaviour(const ForageSettings& settings)
      : settings_(settings),
        speed_mm_s_(static_cast<int16_t>(std::lround(settings.speed_m_s * 1000))) {}

  Status Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
             size_t count) override {
    for (size_t i = first; i < first + count; ++i) {
      Decide(view, actions, i);
    }
    return Ok();
  }

 private:
  struct Nest {
    double away_rad = 0;  // the heading that leads away from it
    double beyond_m = 0;  // the distance from its rim
  };

  static const PheromoneSite* SiteOf(const PheromoneView& view, size_t i) {
    return view.site[i] != 0 ? &view.sites[view.site[i] - 1] : nullptr;
  }

  static Nest NearestNest(const PheromoneView& view, size_t i) {
    Nest nearest{view.heading_rad[i], std::numeric_limits<double>::infinity()};
    for (size_t s = 0; s < view.site_count; ++s) {
      const PheromoneSite& site = view.sites[s];
      const double dx = view.x_m[i] - site.x_m;
      const double dy = view.y_m[i] - site.y_m;
      const double beyond_m = std::hypot(dx, dy) - site.radius_m;
      if (site.is_food == 0 && beyond_m < nearest.beyond_m) {
        nearest = {std::atan2(dy, dx), beyond_m};
      }
    }
    return nearest;
  }

  bool Sensed(const PheromoneView& view, size_t slot, size_t i) const {
    return slot < view.slots &&
           InUnits(std::max(view.p_left[slot][i], view.p_right[slot][i])) >= settings_.faintest;
  }

  WheelPair Along(const PheromoneView& view, size_t slot, size_t i) const {
    return FromLaw(
        client::SteerDifferential(view.p_left[slot][i], view.p_right[slot][i], speed_mm_s_));
  }

  void Decide(const PheromoneView& view, const PheromoneActions& actions, size_t i) const {
    const Walk walk(view, actions, i);
    const PheromoneSite* at = SiteOf(view, i);
    double& left_nest = actions.memory[i * kPheromoneMemory + kLeftNest];
    const Nest nest = NearestNest(view, i);
    walk.at(kIgnore) = std::max(0.0, walk.at(kIgnore) - 1);
    if (at != nullptr && at->is_food == 0) {
      left_nest = static_cast<double>(view.step);
    }
    bool loaded = view.load[i] != 0;
    if (loaded && at != nullptr && at->is_food == 0) {
      actions.load[i] = -1;
      loaded = false;
      walk.Turn(view.heading_rad[i] + std::numbers::pi);
    } else if (!loaded && at != nullptr && at->is_food != 0) {
      if (at->amount >= 1) {
        actions.load[i] = 1;
        loaded = true;
        walk.Turn(nest.away_rad + std::numbers::pi);
      } else {
        walk.at(kIgnore) = walk.StepsOf(settings_.ignore_s);
      }
    }
    SetWheels(actions, i, loaded ? Carry(view, walk, nest, i) : Search(view, walk, nest, i));
    Mark(view, actions, loaded, left_nest, i);
  }

  WheelPair Carry(const PheromoneView& view, const Walk& walk, const Nest& nest, size_t i) const {
    if (!walk.Escapes()) {
      if (settings_.homing == Homing::kBearing) {
        walk.SetCourse(nest.away_rad + std::numbers::pi);
      } else if (Sensed(view, 1, i)) {
        walk.SetCourse(view.heading_rad[i]);
        return Along(view, 1, i);
      } else {
        walk.Wander(settings_.wander_rad);
      }
    }
    return walk.KeepCourse(settings_.speed_m_s);
  }

  WheelPair Search(const PheromoneView& view, const Walk& walk, const Nest& nest, size_t i) const {
    if (walk.Escapes()) {
      return walk.KeepCourse(settings_.speed_m_s);
    }
    if (walk.at(kIgnore) > 0 || !Sensed(view, 0, i)) {
      walk.Wander(settings_.wander_rad);
      return walk.KeepCourse(settings_.speed_m_s);
    }
    if (settings_.homing == Homing::kBearing && nest.beyond_m > kNearNestM &&
        std::cos(view.heading_rad[i] - nest.away_rad) < kHeadsHome) {
      walk.Turn(nest.away_rad);
      return walk.KeepCourse(settings_.speed_m_s);
    }
    walk.SetCourse(view.heading_rad[i]);
    return Along(view, 0, i);
  }

  // The trail of slot 0 with a load, that of slot 1 without one.
  void Mark(const PheromoneView& view, const PheromoneActions& actions, bool loaded,
            double left_nest, size_t i) const {
    if (loaded) {
      actions.quanta[i] = settings_.quanta;
    } else if (settings_.homing == Homing::kPheromone) {
      const double left =
          1 - (static_cast<double>(view.step) - left_nest) * view.step_s / settings_.fade_s;
      actions.quanta[i] = static_cast<uint16_t>(std::ceil(settings_.quanta * std::max(0.0, left)));
      actions.type[i] = view.types[1];
    }
    // It follows one of the two at a time.
    const bool follows_home = loaded && settings_.homing == Homing::kPheromone;
    actions.sense[i] = follows_home ? 2 : loaded ? 0 : 1;
  }

  const ForageSettings settings_;
  const int16_t speed_mm_s_;
};

}  // namespace

std::shared_ptr<Behaviour> MakeForage(const ForageSettings& settings) {
  return std::make_shared<ForageBehaviour>(settings);
}

}  // namespace pheromone::lab
