// The portable kernel: one node at a time, for any processor; the reference for the others.

#include "server/core/field/kernel.h"
#include "server/core/field/kernel_table.h"

namespace pheromone::field {
namespace {

union Bits {
  uint64_t word;
  double number;
};

// Towards zero, |v| < 2^31.
double Truncate(double v) {
  return static_cast<double>(static_cast<int32_t>(v));
}

double LevelAt(const KernelLaw& law, double level, double dt) {
  if (law.exponential) {
    return Truncate(level * Exp2Minus(dt / law.tau_ms) + 0.5);
  }
  // floor(time / tau) in whole numbers. The product is off by less than one, which the exact
  // remainder corrects. More steps than a level has are equivalent to all of them.
  const double time = dt * law.scale;
  const double product = time * law.per_tau;
  double whole = Truncate(product < 4194304 ? product : 4194304);
  const double rest = time - whole * law.tau_ms;
  whole += rest >= law.tau_ms ? 1 : 0;
  whole -= rest >= 0 ? 0 : 1;
  const double left = level - whole * law.unit;
  return left > 0 ? left : 0;
}

// mu in Q16, by the distance squared.
double SpreadAt(const KernelLaw& law, double d2) {
  if (law.gaussian) {
    return law.reach_um2 >= d2 ? Truncate(Exp2Minus(d2 * law.exponent) * 65536 + 0.5) : 0;
  }
  const double slope = (law.reach_um - __builtin_sqrt(d2)) * law.slope + 0.5;
  const double positive = slope > 0 ? slope : 0;
  return Truncate(positive < 65536 ? positive : 65536);
}

void Weigh(const KernelLaw& law, const KernelQuery& query, Candidates* candidates, int antennas,
           int64_t* sum) {
  const auto now = static_cast<double>(query.now_ms);
  for (size_t i = 0; i < candidates->count; ++i) {
    const double x = candidates->x[i];
    const double y = candidates->y[i];
    const double ahead = x * query.cos + y * query.sin;
    const uint64_t word = __atomic_load_n(candidates->word[i], __ATOMIC_RELAXED);
    const double since = now - static_cast<double>(word & kTimeMask);
    const double now_left =
        LevelAt(law, static_cast<double>(word >> kTimeBits), since > 0 ? since : 0);
    const double level = ahead >= 0 ? now_left : 0;
    for (int a = 0; a < antennas; ++a) {
      const double dx = x - query.antenna_x[a];
      const double dy = y - query.antenna_y[a];
      sum[a] += static_cast<int64_t>(level * SpreadAt(law, dx * dx + dy * dy));
    }
  }
}

// Bit 8 * row + i: the node at (left + i, y + row) can contribute.
uint64_t TileMask(float left, float y, const MaskQuery& query) {
  uint64_t mask = 0;
  for (int row = 0; row < 8; ++row) {
    const float at_y = y + static_cast<float>(row);
    const float ahead = -query.margin - at_y * query.sin;
    const float rest = query.radius_squared - at_y * at_y;
    for (int i = 0; i < 8; ++i) {
      const float x = left + static_cast<float>(i);
      const bool seen = x * query.cos >= ahead && x * x <= rest;
      mask |= static_cast<uint64_t>(seen) << (8 * row + i);
    }
  }
  return mask;
}

void Mask(const MaskQuery& query, TileList* tiles) {
  size_t left = 0;
  for (size_t i = 0; i < tiles->count; ++i) {
    const auto x = static_cast<float>(tiles->column[i] * 8 + query.column);
    const auto y = static_cast<float>(tiles->row[i] * 8 + query.row);
    const uint64_t occupied = tiles->occupied[i] & TileMask(x, y, query);
    if (occupied == 0) {
      continue;
    }
    tiles->occupied[left] = occupied;
    tiles->words[left] = tiles->words[i];
    tiles->column[left] = tiles->column[i];
    tiles->row[left] = tiles->row[i];
    ++left;
  }
  tiles->count = left;
}

}  // namespace

const Kernel kScalarKernel = {"scalar", Weigh, Mask};

double Exp2Minus(double x) {
  x = x < kExp2Most ? x : kExp2Most;
  const double n = Truncate(x);
  const double g = (x - n) - 0.5;
  double p = kExp2Coefficient[kExp2Terms - 1];
  for (int k = kExp2Terms - 2; k >= 0; --k) {
    p = p * g + kExp2Coefficient[k];
  }
  Bits bits{};
  bits.word = static_cast<uint64_t>(1023 - static_cast<int>(n)) << 52;
  return p * bits.number;
}

}  // namespace pheromone::field
