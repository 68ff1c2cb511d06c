// A fuzzy controller that steers by two intensities: the baseline for the paper's claim that
// pheromones guide a robot at "levels entirely comparable to those of a fuzzy controller" (Susnea
// et al. 2009).
//
//   FuzzyState state = {kNoError};
//   WheelSpeeds wheels = SteerFuzzy(p_left, p_right, 300, kTunedFuzzy, &state);  // at each answer
//
// A first-order Sugeno controller (Takagi and Sugeno 1985): the rules are
//
//   IF |e| is Z  THEN  u = 0    + d_Z  de,  s = s_Z
//   IF |e| is P  THEN  u = u_P  + d_P  de,  s = s_P
//   IF |e| is PB THEN  u = u_PB + d_PB de,  s = s_PB
//
//   e    (P_L - P_R) / max(1 unit, |P_L|, |P_R|), rounded to 1/2048: the D of the differential law
//   de   e less the e of the answer before; 0 at the first
//   Z, P, PB  triangles around g |e| = 0, 1, 2, each as wide as to its neighbours; PB goes on
//   u    turning share towards the stronger side, the rules' weighted mean, limited to -1 ... 1
//   s    share of the speed
//   v    K s on the outer wheel, K s (1 - 2 |u|) on the inner one: |u| = 1 turns on the spot
//
// For e < 0 everything is mirrored, including de: the labels N and NB have the rules of P and PB,
// and left and right are treated alike to the bit. Neighbouring weights add up to one, so that
// their mean needs no division: the only one is that of the differential law.
//
// Units: P in 1/4096 of a unit; K and the wheels in mm/s. The wheels are as the equations have them
// within 1.5 mm/s for kTunedFuzzy at K = 300 mm/s, and within 1 mm/s + K/200 for any rules. Pure
// except for FuzzyState, which the caller owns, one for each robot.
#pragma once

#include <stdint.h>

#include "client_fw/core/steering/steering.h"

namespace pheromone {
namespace client {

/// The consequents of one label.
struct FuzzyRule {
  int8_t turn_128;   ///< u in 1/128
  int8_t change_64;  ///< d in 1/64
  int8_t speed_128;  ///< s in 1/128, not negative
};

/// The parameters of tuning.
struct FuzzyGains {
  int8_t error_16;     ///< g in 1/16, not negative
  FuzzyRule rules[3];  ///< Z, P, PB. u_Z is 0: a balanced robot has no side to turn to
};

/// Made for the path experiment at five answers a second by `pheromone-experiments laws`, which
/// searched for them (client_fw/experiments/laws/README.md).
constexpr FuzzyGains kTunedFuzzy = {19, {{0, 126, 127}, {84, 85, 127}, {127, 93, 52}}};

/// The error of the last answer, or kNoError before the first and after a pause.
struct FuzzyState {
  int16_t error;
};
constexpr int16_t kNoError = INT16_MIN;

/// Requires 0 <= k_mm_s <= kMaxSpeedMmS. Both wheels stay between -K and K.
WheelSpeeds SteerFuzzy(int16_t p_left, int16_t p_right, int16_t k_mm_s, const FuzzyGains& gains,
                       FuzzyState* state);

}  // namespace client
}  // namespace pheromone
