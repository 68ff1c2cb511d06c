#include "client_fw/core/base/angle.h"

#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {
namespace {

static_assert((INT32_C(-3) >> 1) == -2, "negative numbers must shift towards minus infinity");

// a * b in Q14, to nearest.
PHEROMONE_OUTLINED uint16_t TimesQ14(uint16_t a, uint16_t b) {
  return static_cast<uint16_t>((static_cast<uint32_t>(a) * b + 8192) >> 14);
}

bool Usable(int32_t mm) {
  return mm >= -kMaxCoordinateMm && mm <= kMaxCoordinateMm;
}

}  // namespace

// The cosine of the distance z to the nearer quarter where the sine is 1 or -1, in quarters of a
// turn:
//
//   cos(z pi / 2) = 1 - u (a - u (b - u c)),   u = z^2
//
// a, b and c were chosen among all triples near the best polynomial so that the integers below are
// exact at both ends, increase monotonically, and have the smallest error.
int16_t SinQ14(BinaryAngle angle) {
  uint16_t z = angle & (kQuarterTurn - 1u);
  if ((angle & kQuarterTurn) == 0) {
    z = static_cast<uint16_t>(kQuarterTurn - z);
  }
  const uint16_t u = TimesQ14(z, z);
  const uint16_t inner = static_cast<uint16_t>(4133u - TimesQ14(u, 309));
  const uint16_t outer = static_cast<uint16_t>(20208u - TimesQ14(u, inner));
  const int16_t sine = static_cast<int16_t>(16384u - TimesQ14(u, outer));
  return angle < 2u * kQuarterTurn ? sine : static_cast<int16_t>(-sine);
}

int16_t CosQ14(BinaryAngle angle) {
  return SinQ14(static_cast<BinaryAngle>(angle + kQuarterTurn));
}

StartPose::StartPose(const Pose& start)
    : start_(start), cos_(CosQ14(start.heading)), sin_(SinQ14(start.heading)) {}

Pose StartPose::Of(const Pose& now, const Odometry& odometry) {
  const BinaryAngle heading = static_cast<BinaryAngle>(now.heading - odometry.heading);
  const int16_t cos = CosQ14(heading);
  const int16_t sin = SinQ14(heading);
  return Pose{Along(now.x_mm, odometry, static_cast<int16_t>(-cos), sin),
              Along(now.y_mm, odometry, static_cast<int16_t>(-sin), static_cast<int16_t>(-cos)),
              heading};
}

// `from` + floor((x * cos_x + y * cos_y) / 16384 + 1/2). Bit by bit from the lowest, halving before
// each: floors of halves are the floor of the whole, so nothing is wider than 32 bits.
int32_t StartPose::Along(int32_t from, const Odometry& way, int16_t cos_x, int16_t cos_y) {
  int32_t x = way.x_mm;
  int32_t y = way.y_mm;
  if (!Usable(x) || !Usable(y)) {
    return kFarAway;
  }
  if (cos_x < 0) {
    cos_x = static_cast<int16_t>(-cos_x);
    x = -x;
  }
  if (cos_y < 0) {
    cos_y = static_cast<int16_t>(-cos_y);
    y = -y;
  }
  int32_t sum = 0;
  for (uint8_t bits = 15; bits != 0; --bits) {
    sum >>= 1;
    if ((cos_x & 1) != 0) {
      sum += x;
    }
    if ((cos_y & 1) != 0) {
      sum += y;
    }
    if (bits == 2) {
      ++sum;  // the half
    }
    cos_x = static_cast<int16_t>(cos_x >> 1);
    cos_y = static_cast<int16_t>(cos_y >> 1);
  }
  // Unsigned: what is far off the map may wrap.
  return static_cast<int32_t>(static_cast<uint32_t>(from) + static_cast<uint32_t>(sum));
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
