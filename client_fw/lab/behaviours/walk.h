// What the behaviours that walk have in common: a course that they keep, and how they get free of
// what they have run into. Beside the robot's memory there is no state.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "client_fw/core/steering/steering.h"
#include "client_fw/lab/behaviour_abi.h"
#include "client_fw/lab/chance.h"

namespace pheromone::lab {

/// Numbers of a robot's memory, and what a behaviour draws in a step.
enum WalkMemory : size_t { kCourse, kEscape, kWait, kIgnore };
enum WalkUse : uint64_t { kDrawCourse, kDrawEscape, kDrawTurn };

struct WheelPair {
  double left_m_s = 0;
  double right_m_s = 0;
};

inline WheelPair FromLaw(const client::WheelSpeeds& wheels) {
  return {wheels.left_mm_s / 1000.0, wheels.right_mm_s / 1000.0};
}

/// An intensity of a message in pheromone units.
inline double InUnits(int16_t intensity) {
  return intensity / static_cast<double>(client::kIntensityUnit);
}

/// One robot in one step.
class Walk {
 public:
  /// For this long after a contact it goes away from it.
  static constexpr double kEscapeS = 2;
  /// It turns on the spot at this speed if its course is this far aside.
  static constexpr double kTurnMPerS = 0.1;
  static constexpr double kAsideRad = 0.8;

  Walk(const PheromoneView& view, const PheromoneActions& actions, size_t robot)
      : view_(view), memory_(actions.memory + robot * kPheromoneMemory), robot_(robot) {
    if (view_.step == 0) {
      SetCourse(view_.heading_rad[robot_]);
    }
  }

  double& at(WalkMemory number) const { return memory_[number]; }
  double Uniform(WalkUse use) const {
    return PheromoneUniform(view_.seed, robot_, view_.step, use);
  }
  double StepsOf(double seconds) const { return std::ceil(seconds / view_.step_s); }

  void SetCourse(double heading_rad) const { at(kCourse) = heading_rad; }

  /// On this course, whatever happens, for kEscapeS.
  void Turn(double heading_rad) const {
    SetCourse(heading_rad);
    at(kEscape) = StepsOf(kEscapeS);
  }

  /// Whether it is getting free of something, or turning: then it is to keep its course. From a
  /// wall, that leads back, by up to a right angle aside; of another robot it keeps to the right,
  /// by 45 to 90 degrees: so those that meet head-on on a trail pass each other.
  bool Escapes() const {
    if (at(kEscape) > 0) {
      at(kEscape) -= 1;
      return true;
    }
    if (view_.contact[robot_] == kPheromoneNoContact) {
      return false;
    }
    const double draw = Uniform(kDrawEscape);
    const double aside =
        view_.contact[robot_] == kPheromoneRobotContact ? -(0.25 + draw / 4) : 0.5 + draw;
    Turn(view_.heading_rad[robot_] + std::numbers::pi * aside);
    return true;
  }

  /// A course that drifts by so much in a second: a correlated random walk.
  void Wander(double deviation_rad) const {
    at(kCourse) += deviation_rad * std::sqrt(view_.step_s) *
                   PheromoneNormal(view_.seed, robot_, view_.step, kDrawCourse);
  }

  WheelPair KeepCourse(double speed_m_s) const {
    const double aside =
        std::remainder(at(kCourse) - view_.heading_rad[robot_], 2 * std::numbers::pi);
    if (std::abs(aside) > kAsideRad) {
      const double turn = std::copysign(std::min(kTurnMPerS, speed_m_s), aside);
      return {-turn, turn};
    }
    // The rest of the angle in about four steps.
    const double half =
        std::clamp(aside * view_.wheelbase_m / (8 * view_.step_s), -speed_m_s / 2, speed_m_s / 2);
    return {speed_m_s - std::max(half, 0.0), speed_m_s + std::min(half, 0.0)};
  }

 private:
  const PheromoneView& view_;
  double* memory_;
  size_t robot_;
};

inline void SetWheels(const PheromoneActions& actions, size_t robot, const WheelPair& wheels) {
  actions.left_m_s[robot] = wheels.left_m_s;
  actions.right_m_s[robot] = wheels.right_m_s;
}

}  // namespace pheromone::lab
