// The default law: the differential law with the care that a real robot needs. It slows down where
// it must steer hard or senses less than before, turns aside where a repellent prevails, and looks
// for a trail that it has lost.
//
//   CarefulState state = kCarefulStart;
//   Notice(p_left, p_right, heading, &state);                        // at each answer
//   WheelSpeeds wheels = SteerCareful(p_left, p_right, 600, kUnitGain, state);
//   WheelSpeeds wheels = Search(600, state);                         // where nothing is sensed
//
// Speed. D = (P_L - P_R) / M is that of the differential law (steering.h), P = max(P_L, P_R), and
// P_max its maximum of late, which falls by a 32nd at each answer. K of the differential law is
//
//   k = min(max(K (1 - 3 |D|), K_sure), 2 K P / P_max), limited to K_slow ... K
//
// with K_sure = min(K, 300 mm/s) and K_slow = min(K, 100 mm/s). At five answers a second the
// differential law oscillates about a path above 500 mm/s, more with every bend, because an answer
// is that of a pose several centimetres ago; at K_sure it is damped. So K up to 300 mm/s gives the
// speeds of the differential law, except at less than half of P_max: there a robot leaves the
// trail, or nears a repellent, and must be able to stop.
//
// Repellent. Where P_L and P_R are both negative, more is repellent than attracts. The robot turns
// on the spot at K_slow, towards the less negative side (if equal: where more was sensed last),
// until its heading is 45 degrees aside of that at which it began, and drives on at K_slow until
// neither is negative. Side and first heading are latched: if it comes back into the repellent it
// turns aside to the same side, by half of the angle before, and so goes round. They are released
// by three answers in succession with P_L and P_R above P_max / 2. Eq. (6), Susnea et al. 2009, and
// the differential law compare left with right only: head-on they drive through.
//
// Search. On the spot at K_slow: after turning aside back to where the path was, otherwise towards
// the side where more was sensed last. It is for the caller to end it.
//
// Integers only, with the same bits everywhere. Units: P in 1/4096 of a pheromone unit; mm/s;
// binary angles. Pure functions but for CarefulState, which the caller owns, one for each robot.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/steering/steering.h"

namespace pheromone {
namespace client {

/// Above it, the careful law slows down to steer.
constexpr int16_t kSureSpeedMmS = 300;
/// Its least speed.
constexpr int16_t kSlowSpeedMmS = 100;
/// 45 degrees: how far it turns aside at first.
constexpr BinaryAngle kAsideAngle = 0x2000;

struct CarefulState {
  enum class Mode : uint8_t { kFollowing, kTurningAside, kPassingBy };
  enum class Side : uint8_t { kNone, kLeft, kRight };

  int16_t plateau;     ///< P_max
  BinaryAngle course;  ///< the heading at which it began to turn aside
  BinaryAngle turn;    ///< and how far from there
  Mode mode;
  Side aside;     ///< latched; kNone: no repellent of late
  Side stronger;  ///< where more was sensed last, never kNone
  uint8_t clear;  ///< answers in succession above P_max / 2
};

constexpr CarefulState kCarefulStart = {kIntensityUnit,
                                        0,
                                        0,
                                        CarefulState::Mode::kFollowing,
                                        CarefulState::Side::kNone,
                                        CarefulState::Side::kLeft,
                                        0};

/// Takes note of an answer: the intensities, and the heading with which they were requested.
void Notice(int16_t p_left, int16_t p_right, BinaryAngle heading, CarefulState* state);

/// The wheel speeds for the intensities noted last. Requires 0 <= k_mm_s <= kMaxSpeedMmS.
WheelSpeeds SteerCareful(int16_t p_left, int16_t p_right, int16_t k_mm_s, uint8_t gain_8ths,
                         const CarefulState& state);

/// The wheel speeds for looking around on the spot.
WheelSpeeds Search(int16_t k_mm_s, const CarefulState& state);

}  // namespace client
}  // namespace pheromone
