#include "client_fw/core/tasks/go_to.h"

namespace pheromone {
namespace client {
WheelSpeeds SteerTo(int16_t dx_mm, int16_t dy_mm, BinaryAngle heading, int16_t k_mm_s) {
  const int32_t x = dx_mm;
  const int32_t y = dy_mm;
  const int32_t cos = CosQ14(heading);
  const int32_t sin = SinQ14(heading);
  const int32_t ahead_mm = (x * cos + y * sin) / 16384;
  const int32_t left_mm = (y * cos - x * sin) / 16384;
  const int32_t aside_mm = left_mm < 0 ? -left_mm : left_mm;
  if (ahead_mm <= aside_mm) {
    const int16_t half = static_cast<int16_t>(k_mm_s / 2);
    const int16_t back = static_cast<int16_t>(-half);
    return left_mm < 0 ? WheelSpeeds{half, back} : WheelSpeeds{back, half};
  }
  const int16_t slowed = static_cast<int16_t>(k_mm_s - k_mm_s * aside_mm / ahead_mm);
  return left_mm < 0 ? WheelSpeeds{k_mm_s, slowed} : WheelSpeeds{slowed, k_mm_s};
}

}  // namespace client
}  // namespace pheromone
