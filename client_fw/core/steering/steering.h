// Two intensities in, two wheel speeds out. Integers only, so that every target computes the same.
//
// Units: P_L and P_R in 1/4096 of a pheromone unit, as on the wire; speeds in mm/s. Both laws
// compare the antennas relative to M = max(1 unit, |P_L|, |P_R|), which extends the paper's "P in
// [0, 1]" to any intensity. The one division is rounded, halves up.
//
// Pure functions; any thread, any interrupt.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

/// One pheromone unit, in the unit of intensities.
constexpr uint16_t kIntensityUnit = 4096;
/// The largest K of both laws: what a Pioneer's firmware accepts.
constexpr int16_t kMaxSpeedMmS = 2200;

struct WheelSpeeds {
  int16_t left_mm_s;
  int16_t right_mm_s;
};

inline bool operator==(const WheelSpeeds& a, const WheelSpeeds& b) {
  return a.left_mm_s == b.left_mm_s && a.right_mm_s == b.right_mm_s;
}
inline bool operator!=(const WheelSpeeds& a, const WheelSpeeds& b) {
  return !(a == b);
}

/// The gain of the laws as they are defined.
constexpr uint8_t kUnitGain = 8;
/// The largest: kMaxSpeedMmS times it fits 16 bits.
constexpr uint8_t kMaxGain = 29;

enum class Law : uint8_t { kDifferential, kPaper, kFuzzy, kCareful };

/// kDifferential: D = (P_L - P_R) / M, v_L = K (1 - max(D, 0)), v_R = K (1 - max(-D, 0)): straight
/// ahead at K when balanced, otherwise towards the stronger side by slowing the wheel on that side.
/// The slowed wheel runs backwards, down to -K, if the intensities have opposite signs.
///
/// kPaper: eq. (6), Susnea et al. 2009, as printed, with d = |P_L - P_R| / M: the wheel on the
/// stronger side turns at K (1 - d), the other at K d; both stand still when balanced. So the robot
/// turns away from the stronger side for d < 1/2 and towards it for d > 1/2. For reproducing the
/// paper. Speeds are in [-K, 2 K].
///
/// `gain_8ths` multiplies D and d, in 1/8 and up to kMaxGain: above 8 the robot turns more sharply.
/// D and d are limited to 2, their maximum without a gain.
///
/// kFuzzy and kCareful have states and functions of their own, SteerFuzzy (fuzzy.h) and
/// SteerCareful (careful.h); here they are treated as kDifferential.
///
/// Requires 0 <= k_mm_s <= kMaxSpeedMmS.
WheelSpeeds Steer(Law law, int16_t p_left, int16_t p_right, int16_t k_mm_s,
                  uint8_t gain_8ths = kUnitGain);

inline WheelSpeeds SteerDifferential(int16_t p_left, int16_t p_right, int16_t k_mm_s) {
  return Steer(Law::kDifferential, p_left, p_right, k_mm_s);
}

inline WheelSpeeds SteerPaper(int16_t p_left, int16_t p_right, int16_t k_mm_s) {
  return Steer(Law::kPaper, p_left, p_right, k_mm_s);
}

}  // namespace client
}  // namespace pheromone
