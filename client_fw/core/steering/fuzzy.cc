#include "client_fw/core/steering/fuzzy.h"

#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {
namespace {

// 1 of s and of a rule's weight.
constexpr int16_t kOne = 4096;
// 1 of e and u, and the distance between two labels: half the resolution, so that the sums and
// doubled values below fit an int16_t even if e jumps from -2 to 2.
constexpr int16_t kErrorOne = kOne / 2;

// a b / kOne, halves up.
PHEROMONE_OUTLINED int16_t Share(int16_t a, int16_t b) {
  return static_cast<int16_t>((static_cast<int32_t>(a) * b + kOne / 2) >> 12);
}

// x times the weighted mean of a consequent of two rules; `at` is the weight of the second.
PHEROMONE_OUTLINED int16_t Infer(int8_t first_128, int8_t second_128, int16_t at, int16_t x) {
  const int16_t first = static_cast<int16_t>(first_128 * (kOne / 128));
  const int16_t second = static_cast<int16_t>(second_128 * (kOne / 128));
  return Share(x, static_cast<int16_t>(first + Share(static_cast<int16_t>(second - first), at)));
}

}  // namespace

WheelSpeeds SteerFuzzy(int16_t p_left, int16_t p_right, int16_t k_mm_s, const FuzzyGains& gains,
                       FuzzyState* state) {
  const WheelSpeeds share = SteerDifferential(p_left, p_right, kErrorOne);
  int16_t error = static_cast<int16_t>(share.right_mm_s - share.left_mm_s);
  int16_t before = state->error;
  state->error = error;
  if (before == kNoError) {
    before = error;
  }
  int16_t change = static_cast<int16_t>(error - before);
  // If the error is 0, its change decides the side, so that both sides are rounded alike.
  bool to_right = error < 0 || (error == 0 && change < 0);
  if (to_right) {
    error = static_cast<int16_t>(-error);
    change = static_cast<int16_t>(-change);
  }

  // From Z to P, or from P to PB; g |e| is in the error's unit, so that any g and e fit.
  const FuzzyRule* rule = gains.rules;
  int16_t at = Share(error, static_cast<int16_t>(gains.error_16 * (kOne / 16)));
  if (at > kErrorOne) {
    ++rule;
    at = static_cast<int16_t>(at - kErrorOne);
    if (at > kErrorOne) {
      at = kErrorOne;
    }
  }
  at = static_cast<int16_t>(2 * at);
  int16_t turn = static_cast<int16_t>(
      Infer(rule[0].turn_128, rule[1].turn_128, at, kErrorOne) +
      Infer(rule[0].change_64, rule[1].change_64, at, static_cast<int16_t>(2 * change)));
  if (turn < 0) {
    to_right = !to_right;
    turn = static_cast<int16_t>(-turn);
  }
  if (turn > kErrorOne) {
    turn = kErrorOne;
  }
  int16_t right = Infer(rule[0].speed_128, rule[1].speed_128, at, k_mm_s);
  int16_t left = static_cast<int16_t>(right - Share(static_cast<int16_t>(4 * right), turn));
  if (to_right) {
    const int16_t inner = left;
    left = right;
    right = inner;
  }
  return WheelSpeeds{left, right};
}

}  // namespace client
}  // namespace pheromone
