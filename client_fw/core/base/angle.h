// Angles and poses on a robot, in integers.
//
// Units: positions in mm; angles as binary angles (uint16_t, 65 536 a turn, counter-clockwise from
// +x, so that they wrap by themselves); sines and cosines in 1/16 384 (Q14).
//
// Pure functions; any thread, any interrupt. The sine is a polynomial, since tables of constants
// live in RAM on an AVR.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

using BinaryAngle = uint16_t;
constexpr BinaryAngle kQuarterTurn = 0x4000;

/// Sine and cosine in Q14. Within 2/16 384 of the exact value (the resolution of an angle is 1.6/16
/// 384 rad); exact on the axes; equal to each other at 45 degrees; odd and even to the bit.
int16_t SinQ14(BinaryAngle angle);
int16_t CosQ14(BinaryAngle angle);

/// A robot's position and heading, on the map or in its own odometry.
struct Pose {
  int32_t x_mm;
  int32_t y_mm;
  BinaryAngle heading;
};

/// The pose reported by a drive, which starts at 0, 0, 0 when it is switched on.
using Odometry = Pose;

/// The largest absolute value of a coordinate, in odometry or on the map (16.8 km).
constexpr int32_t kMaxCoordinateMm = 16777216;
constexpr int32_t kFarAway = INT32_MAX;

/// From odometry to the map: pose = start + R(start heading) * odometry. Each coordinate is within
/// 1 mm and 0.2 mm for each metre from the start, the resolution of Q14.
class StartPose {
 public:
  /// Requires |x_mm|, |y_mm| <= kMaxCoordinateMm.
  explicit StartPose(const Pose& start);

  /// The pose on the map; x_mm and y_mm are kFarAway if odometry is over kMaxCoordinateMm.
  Pose Place(const Odometry& odometry) const {
    return Pose{XOf(odometry), YOf(odometry), HeadingOf(odometry)};
  }
  int32_t XOf(const Odometry& odometry) const {
    return Along(start_.x_mm, odometry, cos_, static_cast<int16_t>(-sin_));
  }
  int32_t YOf(const Odometry& odometry) const { return Along(start_.y_mm, odometry, sin_, cos_); }
  BinaryAngle HeadingOf(const Odometry& odometry) const {
    return static_cast<BinaryAngle>(start_.heading + odometry.heading);
  }

  /// The start from which the robot has come to `now` if its odometry is `odometry`; each
  /// coordinate is kFarAway if odometry is over kMaxCoordinateMm.
  static Pose Of(const Pose& now, const Odometry& odometry);

 private:
  static int32_t Along(int32_t from, const Odometry& way, int16_t cos_x, int16_t cos_y);

  Pose start_;
  int16_t cos_;
  int16_t sin_;
};

/// `mm` in the server's pose unit, which is `unit_10um` times 10 micrometres (HELLO), to the
/// nearest unit, halves away from zero. False if |mm| is over kMaxCoordinateMm or the unit is 0.
bool ToPoseUnits(int32_t mm, uint16_t unit_10um, int32_t* units);

}  // namespace client
}  // namespace pheromone
