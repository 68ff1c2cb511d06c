#include "client_fw/core/angle.h"

namespace pheromone {
namespace client {
namespace {

// sin(i * 90 degrees / 64).
const int16_t kSineQ14[65] = {
    0,     402,   804,   1205,  1606,  2006,  2404,  2801,  3196,  3590,  3981,  4370,  4756,
    5139,  5520,  5897,  6270,  6639,  7005,  7366,  7723,  8076,  8423,  8765,  9102,  9434,
    9760,  10080, 10394, 10702, 11003, 11297, 11585, 11866, 12140, 12406, 12665, 12916, 13160,
    13395, 13623, 13842, 14053, 14256, 14449, 14635, 14811, 14978, 15137, 15286, 15426, 15557,
    15679, 15791, 15893, 15986, 16069, 16143, 16207, 16261, 16305, 16340, 16364, 16379, 16384};

static_assert((INT32_C(-3) >> 1) == -2, "negative numbers must shift towards minus infinity");

// (x * cos_x + y * cos_y) / 16384, halves up. The 40-bit products are avoided by splitting x and y
// at 2^16: the high words' products are whole after the division, and those of the low words add up
// to less than 2^31. Not inlined: it is big, and called twice.
__attribute__((noinline)) int32_t DotQ14(int32_t x, int16_t cos_x, int32_t y, int16_t cos_y) {
  const int32_t high = static_cast<int32_t>(static_cast<int16_t>(x >> 16)) * cos_x +
                       static_cast<int32_t>(static_cast<int16_t>(y >> 16)) * cos_y;
  const int32_t low = static_cast<int32_t>(static_cast<uint16_t>(x & 0xFFFF)) * cos_x +
                      static_cast<int32_t>(static_cast<uint16_t>(y & 0xFFFF)) * cos_y;
  return high * 4 + ((low + 8192) >> 14);
}

bool Usable(int32_t mm) {
  return mm >= -kMaxCoordinateMm && mm <= kMaxCoordinateMm;
}

}  // namespace

int16_t SinQ14(BinaryAngle angle) {
  uint16_t within = angle & (kQuarterTurn - 1u);
  if ((angle & kQuarterTurn) != 0) {
    within = static_cast<uint16_t>(kQuarterTurn - within);
  }
  const int16_t* entry = kSineQ14 + (within >> 8);
  int16_t sine = *entry;
  const uint8_t part = static_cast<uint8_t>(within & 0xFFu);
  if (part != 0) {  // so that the entry after the last is not read
    const int32_t rise = entry[1] - sine;
    sine = static_cast<int16_t>(sine + (rise * part + 128) / 256);
  }
  return angle < 2u * kQuarterTurn ? sine : static_cast<int16_t>(-sine);
}

int16_t CosQ14(BinaryAngle angle) {
  return SinQ14(static_cast<BinaryAngle>(angle + kQuarterTurn));
}

StartPose::StartPose(const Pose& start)
    : start_(start), cos_(CosQ14(start.heading)), sin_(SinQ14(start.heading)) {}

Pose StartPose::Place(const Odometry& odometry) const {
  Pose placed = {kFarAway, kFarAway, static_cast<BinaryAngle>(start_.heading + odometry.heading)};
  if (Usable(odometry.x_mm) && Usable(odometry.y_mm)) {
    const int16_t minus_sin = static_cast<int16_t>(-sin_);
    placed.x_mm = start_.x_mm + DotQ14(odometry.x_mm, cos_, odometry.y_mm, minus_sin);
    placed.y_mm = start_.y_mm + DotQ14(odometry.x_mm, sin_, odometry.y_mm, cos_);
  }
  return placed;
}

bool ToPoseUnits(int32_t mm, uint16_t unit_10um, int32_t* units) {
  if (unit_10um == 0 || !Usable(mm)) {
    return false;
  }
  const uint32_t size_10um = static_cast<uint32_t>(mm < 0 ? -mm : mm) * 100u;
  const int32_t size = static_cast<int32_t>((size_10um + unit_10um / 2u) / unit_10um);
  *units = mm < 0 ? -size : size;
  return true;
}

}  // namespace client
}  // namespace pheromone
