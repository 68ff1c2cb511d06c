#include "client_fw/core/steering/steering.h"

namespace pheromone {
namespace client {
namespace {

// At most 32 768, which an int16_t could not hold.
uint16_t Magnitude(int16_t value) {
  const uint16_t bits = static_cast<uint16_t>(value);
  return value < 0 ? static_cast<uint16_t>(0u - bits) : bits;
}

uint16_t Larger(uint16_t a, uint16_t b) {
  return a > b ? a : b;
}

}  // namespace

WheelSpeeds Steer(Law law, int16_t p_left, int16_t p_right, int16_t k_mm_s, uint8_t gain_8ths) {
  const uint16_t scale = Larger(kIntensityUnit, Larger(Magnitude(p_left), Magnitude(p_right)));
  // Modulo 2^16 the right one of the two differences is exact: it is at most 65 535.
  const bool left_stronger = p_left > p_right;
  const uint16_t left = static_cast<uint16_t>(p_left);
  const uint16_t right = static_cast<uint16_t>(p_right);
  const uint16_t difference = static_cast<uint16_t>(left_stronger ? left - right : right - left);
  // K g |P_L - P_R| / M, halves up: at most 7975 * 65 535 before the division.
  const uint16_t k_g = static_cast<uint16_t>(static_cast<uint16_t>(k_mm_s) * gain_8ths) >> 3;
  const uint32_t product = static_cast<uint32_t>(difference) * k_g;
  const uint16_t size = static_cast<uint16_t>((product + scale / 2) / scale);
  const uint16_t most = static_cast<uint16_t>(2 * k_mm_s);
  const int16_t term = static_cast<int16_t>(size < most ? size : most);
  int16_t stronger = static_cast<int16_t>(k_mm_s - term);
  int16_t weaker = k_mm_s;
  if (law == Law::kPaper) {
    weaker = term;
    if (difference == 0) {
      stronger = 0;
    }
  }
  return left_stronger ? WheelSpeeds{stronger, weaker} : WheelSpeeds{weaker, stronger};
}

}  // namespace client
}  // namespace pheromone
