#include "client_fw/lab/behaviours/walkers.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client_fw/lab/behaviours/walk.h"

namespace pheromone::lab {
namespace {

class ExploreBehaviour : public Behaviour {
 public:
  explicit ExploreBehaviour(const ExploreSettings& settings) : settings_(settings) {}

  Status Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
             size_t count) override {
    for (size_t i = first; i < first + count; ++i) {
      const Walk walk(view, actions, i);
      if (!walk.Escapes()) {
        walk.Wander(settings_.wander_rad);
      }
      SetWheels(actions, i, walk.KeepCourse(settings_.speed_m_s));
      actions.quanta[i] = settings_.quanta;
    }
    return Ok();
  }

 private:
  const ExploreSettings settings_;
};

class PatrolBehaviour : public Behaviour {
 public:
  explicit PatrolBehaviour(const PatrolSettings& settings)
      : settings_(settings.walk),
        speed_mm_s_(static_cast<int16_t>(std::lround(settings.walk.speed_m_s * 1000))),
        gain_8ths_(static_cast<uint8_t>(std::lround(settings.gain * client::kUnitGain))) {}

  Status Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
             size_t count) override {
    for (size_t i = first; i < first + count; ++i) {
      const Walk walk(view, actions, i);
      const int16_t left = view.p_left[0][i];
      const int16_t right = view.p_right[0][i];
      actions.quanta[i] = settings_.quanta;
      if (walk.Escapes()) {
        SetWheels(actions, i, walk.KeepCourse(settings_.speed_m_s));
      } else if (left != right) {
        walk.SetCourse(view.heading_rad[i]);
        SetWheels(actions, i,
                  FromLaw(client::Steer(client::Law::kDifferential, right, left, speed_mm_s_,
                                        gain_8ths_)));
      } else {
        walk.Wander(settings_.wander_rad);
        SetWheels(actions, i, walk.KeepCourse(settings_.speed_m_s));
      }
    }
    return Ok();
  }

 private:
  const ExploreSettings settings_;
  const int16_t speed_mm_s_;
  const uint8_t gain_8ths_;
};

class AggregateBehaviour : public Behaviour {
 public:
  explicit AggregateBehaviour(const AggregateSettings& settings) : settings_(settings) {}

  Status Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
             size_t count) override {
    for (size_t i = first; i < first + count; ++i) {
      const Walk walk(view, actions, i);
      double& wait = walk.at(kWait);
      if (wait > 0) {
        actions.quanta[i] = settings_.walk.quanta;
        wait -= 1;
        if (wait <= 0) {
          walk.Turn(2 * std::numbers::pi * walk.Uniform(kDrawTurn));
        }
        continue;
      }
      if (view.contact[i] == kPheromoneRobotContact && walk.at(kEscape) <= 0) {
        const double p = std::max(0.0, InUnits(std::max(view.p_left[0][i], view.p_right[0][i])));
        wait = walk.StepsOf(settings_.wait_s * p * p / (p * p + settings_.half * settings_.half));
        if (wait > 0) {
          continue;
        }
      }
      if (!walk.Escapes()) {
        walk.Wander(settings_.walk.wander_rad);
      }
      SetWheels(actions, i, walk.KeepCourse(settings_.walk.speed_m_s));
    }
    return Ok();
  }

 private:
  const AggregateSettings settings_;
};

}  // namespace

std::shared_ptr<Behaviour> MakeExplore(const ExploreSettings& settings) {
  return std::make_shared<ExploreBehaviour>(settings);
}

std::shared_ptr<Behaviour> MakePatrol(const PatrolSettings& settings) {
  return std::make_shared<PatrolBehaviour>(settings);
}

std::shared_ptr<Behaviour> MakeAggregate(const AggregateSettings& settings) {
  return std::make_shared<AggregateBehaviour>(settings);
}

}  // namespace pheromone::lab
