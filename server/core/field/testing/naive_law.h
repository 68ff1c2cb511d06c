// The equations of one pheromone and of one line of sight, read literally off the paper and
// protocol/README.md. Shares no arithmetic with the code under test: evaporation counts down step
// by step, the Z-shape is rounded by comparing integers, exponentials and trigonometry are libm's
// in long double, and sight is decided by separating axes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "server/core/field/geometry.h"
#include "server/core/field/law.h"

namespace pheromone::field::testing {

__extension__ using Wide = __int128;

/// What is left of `level` after `dt_ms`: exact for the laws that go by steps; for the exponential
/// one as near as a long double comes.
inline int64_t NaiveLevel(const PheromoneLaw& law, int64_t level, uint64_t dt_ms) {
  if (law.tau_ms == 0) {
    return level;
  }
  if (law.evaporation == Evaporation::kExponential) {
    const long double halvings =
        static_cast<long double>(dt_ms) / static_cast<long double>(law.tau_ms);
    const long double left = static_cast<long double>(level) * std::exp2(-halvings);
    return static_cast<int64_t>(std::floor(left + 0.5L));
  }
  // A step every tau takes 64 levels, or one every tau / 64 takes a single one.
  const bool linear = law.evaporation == Evaporation::kLinear;
  const Wide elapsed = Wide{dt_ms} * (linear ? 64 : 1);
  const int64_t loss = linear ? 1 : 64;
  for (Wide due = law.tau_ms; due <= elapsed && level > 0; due += law.tau_ms) {
    level = std::max<int64_t>(0, level - loss);
  }
  return level;
}

/// floor(65 536 mu(d) + 1/2) at the distance d = sqrt(d2), as if computed without any error.
///
/// Z-shape, eq. (1): the largest m with m - 1/2 <= 65 536 (R - d) / sigma, that is
/// (131 072 d)^2 <= (131 072 R - (2 m - 1) sigma)^2.
inline int64_t NaiveSpread(const PheromoneLaw& law, int64_t d2) {
  if (law.profile == Profile::kGaussian) {
    const auto sigma = static_cast<long double>(law.sigma_um);
    const long double mu = std::exp(-static_cast<long double>(d2) / (2 * sigma * sigma));
    const bool reached = Wide{d2} <= Wide{law.cutoff_um} * law.cutoff_um;
    return reached ? static_cast<int64_t>(std::floor(65536 * mu + 0.5L)) : 0;
  }
  const Wide core = law.core_um;
  const Wide reach = core + law.sigma_um;
  if (d2 <= core * core) {
    return 65536;
  }
  if (d2 > reach * reach) {
    return 0;
  }
  int64_t low = 0;  // holds
  int64_t high = 65536;
  while (low < high) {
    const int64_t m = (low + high + 1) / 2;
    const Wide bound = 131072 * reach - (2 * Wide{m} - 1) * law.sigma_um;
    const bool holds = bound >= 0 && Wide{131072} * 131072 * d2 <= bound * bound;
    (holds ? low : high) = holds ? m : m - 1;
  }
  return low;
}

/// The unit vector of a binary angle in 1/16 384, each component rounded to nearest.
inline PointUm NaiveDirection(int64_t binary_angle) {
  const long double angle =
      2 * std::numbers::pi_v<long double> * static_cast<long double>(binary_angle) / 65536;
  return {std::llround(16384 * std::cos(angle)), std::llround(16384 * std::sin(angle))};
}

/// Whether the straight line from `a` to `b`, its ends included, stays out of the inside of the
/// square with the side `side` around `centre`. Two convex sets are apart if they are so along one
/// of the directions across their edges. All lengths are doubled, to keep half a side whole.
inline bool NaivePasses(PointUm a, PointUm b, PointUm centre, int64_t side) {
  const Wide ax = 2 * Wide{a.x - centre.x};
  const Wide ay = 2 * Wide{a.y - centre.y};
  const Wide bx = 2 * Wide{b.x - centre.x};
  const Wide by = 2 * Wide{b.y - centre.y};
  const auto magnitude = [](Wide v) { return v < 0 ? -v : v; };
  if (std::min(ax, bx) >= side || std::max(ax, bx) <= -side || std::min(ay, by) >= side ||
      std::max(ay, by) <= -side) {
    return true;
  }
  const Wide across_x = ay - by;  // across the line; of a line that is a point, zero
  const Wide across_y = bx - ax;
  const Wide half_width = side * (magnitude(across_x) + magnitude(across_y));
  return half_width > 0 && magnitude(ax * across_x + ay * across_y) >= half_width;
}

}  // namespace pheromone::field::testing
