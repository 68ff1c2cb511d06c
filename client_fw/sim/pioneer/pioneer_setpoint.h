// What one axis of a Pioneer's motion, translation or rotation, is to do: hold a speed (VEL, RVEL),
// or cover a way and stand (MOVE, HEAD). ARCOS covers a way with a trapezoid of speed, computed
// anew all the time: as fast as its limits admit, and slower when the rest of the way is needed to
// stop (Pioneer 3 operations manual, "Robots in motion").
//
//   Setpoint translation;
//   translation.Cover(0.5);
//   every tick: speed towards translation.SpeedAfter(present, 0.3, 0.001), then
//               translation.OnCovered(way of the tick);
//
// Units: metres or radians, and seconds. No errors; one thread.
#pragma once

#include <algorithm>
#include <cmath>

namespace pheromone::sim {

class Setpoint {
 public:
  /// Holds a speed; ends a way that is being covered.
  void Hold(double speed) {
    speed_ = speed;
    covers_ = false;
  }

  /// Covers `way` from here, backwards if negative, and then stands.
  void Cover(double way) {
    speed_ = 0;
    rest_ = way;
    covers_ = true;
  }

  /// The speed to have after a tick that begins with `present`. Of a way, v with which the rest
  /// behind the tick is just enough to stop at `deceleration` d:
  /// v^2 / 2d = rest - (present + v) / 2 * tick.
  double SpeedAfter(double present, double deceleration, double tick_s) const {
    if (!covers_) {
      return speed_;
    }
    const double rest = std::abs(rest_);
    const double towards = std::copysign(present, present * rest_);
    const double half_step = deceleration * tick_s / 2;
    const double square = half_step * half_step + 2 * deceleration * (rest - towards * tick_s / 2);
    const double speed = std::sqrt(std::max(square, 0.0)) - half_step;
    return std::copysign(std::max(speed, 0.0), rest_);
  }

  /// After each tick: the way that it covered, and the speed at its end.
  void OnCovered(double way, double speed) {
    if (covers_) {
      rest_ -= way;
      covers_ = speed != 0 || std::abs(rest_) > kArrived;
    }
  }

  /// Whether a way is being covered, and what is left of it; 0 otherwise.
  bool covers() const { return covers_; }
  double rest() const { return covers_ ? rest_ : 0; }

 private:
  // Rounding by ticks of 1 ms leaves less than 2 um, or urad, at the highest decelerations.
  static constexpr double kArrived = 1e-5;

  double speed_ = 0;
  double rest_ = 0;
  bool covers_ = false;
};

}  // namespace pheromone::sim
