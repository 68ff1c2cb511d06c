#include "client_fw/core/steering/careful.h"

#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {
namespace {

using Mode = CarefulState::Mode;
using Side = CarefulState::Side;

constexpr uint8_t kClearAnswers = 3;  // release the latch
constexpr int16_t kErrorOne = 2048;   // 1 of |D|
constexpr int16_t kErrorWeight = 3;   // of |D| in the speed

int16_t Larger(int16_t a, int16_t b) {
  return a > b ? a : b;
}

int16_t Smaller(int16_t a, int16_t b) {
  return a < b ? a : b;
}

PHEROMONE_OUTLINED WheelSpeeds TurnOnTheSpot(Side side, int16_t mm_s) {
  const int16_t back = static_cast<int16_t>(-mm_s);
  return side == Side::kLeft ? WheelSpeeds{back, mm_s} : WheelSpeeds{mm_s, back};
}

// K (1 - 3 |D|), but not below K_sure.
int16_t SpeedForTurn(int16_t p_left, int16_t p_right, int16_t k_mm_s) {
  const WheelSpeeds share = SteerDifferential(p_left, p_right, kErrorOne);
  const int16_t size = share.left_mm_s < share.right_mm_s
                           ? static_cast<int16_t>(share.right_mm_s - share.left_mm_s)
                           : static_cast<int16_t>(share.left_mm_s - share.right_mm_s);
  const int16_t error = Smaller(static_cast<int16_t>(kErrorWeight * size), kErrorOne);
  const int16_t less = static_cast<int16_t>(static_cast<uint32_t>(k_mm_s) *
                                            static_cast<uint16_t>(error) / kErrorOne);
  return Larger(static_cast<int16_t>(k_mm_s - less), Smaller(k_mm_s, kSureSpeedMmS));
}

}  // namespace

PHEROMONE_BY_POINTER void Notice(int16_t p_left, int16_t p_right, BinaryAngle heading,
                                 CarefulState* state) {
  const int16_t most = Larger(p_left, p_right);
  const int16_t least = Smaller(p_left, p_right);
  if (p_left != p_right) {
    state->stronger = p_left > p_right ? Side::kLeft : Side::kRight;
  }
  state->plateau = Larger(most, static_cast<int16_t>(state->plateau - state->plateau / 32));

  if (least >= 0) {
    state->mode = Mode::kFollowing;
  } else if (most < 0 || state->mode != Mode::kFollowing) {
    if (state->aside == Side::kNone) {
      state->aside = state->stronger;
      state->course = heading;
      state->turn = kAsideAngle;
    } else if (state->mode == Mode::kFollowing) {
      state->turn = static_cast<BinaryAngle>(state->turn / 2);
    }
    const BinaryAngle turned = static_cast<BinaryAngle>(
        state->aside == Side::kLeft ? heading - state->course : state->course - heading);
    state->mode = static_cast<int16_t>(turned) < static_cast<int16_t>(state->turn)
                      ? Mode::kTurningAside
                      : Mode::kPassingBy;
  }
  if (least <= state->plateau / 2) {
    state->clear = 0;
  } else if (++state->clear >= kClearAnswers) {
    state->clear = kClearAnswers;
    state->aside = Side::kNone;
  }
}

WheelSpeeds SteerCareful(int16_t p_left, int16_t p_right, int16_t k_mm_s, uint8_t gain_8ths,
                         const CarefulState& state) {
  const int16_t slow = Smaller(k_mm_s, kSlowSpeedMmS);
  if (state.mode == Mode::kTurningAside) {
    return TurnOnTheSpot(state.aside, slow);
  }
  if (state.mode == Mode::kPassingBy) {
    return WheelSpeeds{slow, slow};
  }
  int16_t speed = SpeedForTurn(p_left, p_right, k_mm_s);
  const int16_t most = Larger(p_left, p_right);
  const int16_t half = static_cast<int16_t>(state.plateau / 2);
  if (most < half) {
    speed = Smaller(
        speed, static_cast<int16_t>(static_cast<uint32_t>(k_mm_s) * static_cast<uint16_t>(most) /
                                    static_cast<uint16_t>(half)));
  }
  return Steer(Law::kDifferential, p_left, p_right, Larger(speed, slow), gain_8ths);
}

WheelSpeeds Search(int16_t k_mm_s, const CarefulState& state) {
  Side side = state.stronger;
  if (state.aside != Side::kNone) {
    side = state.aside == Side::kLeft ? Side::kRight : Side::kLeft;
  }
  return TurnOnTheSpot(side, Smaller(k_mm_s, kSlowSpeedMmS));
}

}  // namespace client
}  // namespace pheromone
