// The inner loops, written once over a type `Lanes` that stands for a vector of doubles and names
// the few operations that they need. Included by kernel_*.cc alone, each compiled for its own
// instruction set; everything is in an unnamed namespace, and nothing of the standard library is
// used (kernel.h says why).
//
// Lanes: kWidth; V (a vector), W (of words), M (the result of a comparison); Set, Load, LoadWords
// (from addresses), TimeOf (the low 42 bits of words as numbers), LevelOf (the high 22), Store,
// Add, Sub, Mul, Div, Sqrt, Min, Max, Truncate (towards zero, |v| < 2^31), AtLeast (a >= b), Keep
// (v where m, else 0), PowerOfTwo (2^-n for whole 0 <= n <= 60).
#pragma once

#include "server/field/kernel.h"

namespace pheromone::field {
namespace {  // NOLINT(google-build-namespaces): a kernel each, and no two may share code

template <typename L>
inline typename L::V Exp2Minus(typename L::V x) {
  x = L::Min(x, L::Set(kExp2Most));
  const typename L::V n = L::Truncate(x);
  const typename L::V g = L::Sub(L::Sub(x, n), L::Set(0.5));
  typename L::V p = L::Set(kExp2Coefficient[kExp2Terms - 1]);
  for (int k = kExp2Terms - 2; k >= 0; --k) {
    p = L::Add(L::Mul(p, g), L::Set(kExp2Coefficient[k]));
  }
  return L::Mul(p, L::PowerOfTwo(n));
}

template <typename L, bool kExponential, bool kGaussian, size_t kAntennas>
void Weigh(const KernelLaw& law, const KernelQuery& query, Candidates* candidates, int64_t* sum) {
  using V = typename L::V;
  const size_t count = candidates->count;
  static constexpr uint64_t kNothing = 0;
  for (size_t i = count; i % static_cast<size_t>(L::kWidth) != 0; ++i) {
    candidates->word[i] = &kNothing;
    candidates->x[i] = 0;
    candidates->y[i] = 0;
  }
  const V now = L::Set(static_cast<double>(query.now_ms));
  const V zero = L::Set(0);
  const V half = L::Set(0.5);
  const V one = L::Set(1);
  const V tau = L::Set(law.tau_ms);
  const V one_q16 = L::Set(65536);
  // Whole numbers below 2^38 * 512: exact in any order.
  V total[kAntennas];
  for (V& t : total) {
    t = zero;
  }
  for (size_t i = 0; i < count; i += static_cast<size_t>(L::kWidth)) {
    const V x = L::Load(candidates->x + i);
    const V y = L::Load(candidates->y + i);
    const V ahead = L::Add(L::Mul(x, L::Set(query.cos)), L::Mul(y, L::Set(query.sin)));
    const typename L::W words = L::LoadWords(candidates->word + i);
    V level = L::LevelOf(words);
    const V dt = L::Max(L::Sub(now, L::TimeOf(words)), zero);
    if (kExponential) {
      const V left = L::Mul(level, Exp2Minus<L>(L::Div(dt, tau)));
      level = L::Truncate(L::Add(left, half));
    } else {
      // floor(time / tau) in whole numbers. The product is off by less than one, which the
      // remainder, exact, tells; a division would take longer. More steps than a level has are as
      // good as all.
      const V time = L::Mul(dt, L::Set(law.scale));
      const V near = L::Truncate(L::Min(L::Mul(time, L::Set(law.per_tau)), L::Set(4194304)));
      const V rest = L::Sub(time, L::Mul(near, tau));
      const V more = L::Keep(L::AtLeast(rest, tau), one);
      const V less = L::Sub(one, L::Keep(L::AtLeast(rest, zero), one));
      const V whole = L::Sub(L::Add(near, more), less);
      level = L::Max(L::Sub(level, L::Mul(whole, L::Set(law.unit))), zero);
    }
    level = L::Keep(L::AtLeast(ahead, zero), level);
    for (size_t a = 0; a < kAntennas; ++a) {
      const V dx = L::Sub(x, L::Set(query.antenna_x[a]));
      const V dy = L::Sub(y, L::Set(query.antenna_y[a]));
      const V d2 = L::Add(L::Mul(dx, dx), L::Mul(dy, dy));
      V mu;
      if (kGaussian) {
        const V bell = Exp2Minus<L>(L::Mul(d2, L::Set(law.exponent)));
        mu = L::Truncate(L::Add(L::Mul(bell, one_q16), half));
        mu = L::Keep(L::AtLeast(L::Set(law.reach_um2), d2), mu);
      } else {
        const V slope = L::Mul(L::Sub(L::Set(law.reach_um), L::Sqrt(d2)), L::Set(law.slope));
        mu = L::Truncate(L::Min(L::Max(L::Add(slope, half), zero), one_q16));
      }
      total[a] = L::Add(total[a], L::Mul(level, mu));
    }
  }
  for (size_t a = 0; a < kAntennas; ++a) {
    double lane[8];
    L::Store(lane, total[a]);
    for (int i = 0; i < L::kWidth; ++i) {
      sum[a] += static_cast<int64_t>(lane[i]);
    }
  }
}

template <typename L, size_t kAntennas>
void WeighAny(const KernelLaw& law, const KernelQuery& query, Candidates* candidates,
              int64_t* sum) {
  if (law.exponential) {
    law.gaussian ? Weigh<L, true, true, kAntennas>(law, query, candidates, sum)
                 : Weigh<L, true, false, kAntennas>(law, query, candidates, sum);
  } else {
    law.gaussian ? Weigh<L, false, true, kAntennas>(law, query, candidates, sum)
                 : Weigh<L, false, false, kAntennas>(law, query, candidates, sum);
  }
}

template <typename L>
void WeighFor(const KernelLaw& law, const KernelQuery& query, Candidates* candidates, int antennas,
              int64_t* sum) {
  antennas == 2 ? WeighAny<L, 2>(law, query, candidates, sum)
                : WeighAny<L, 1>(law, query, candidates, sum);
}

// L::TileMask(x, y, query) is a bitmap: bit 8 * row + i says that the node at (x + i, y + row) can
// count. No branch depends on what the tiles hold: it could not be foreseen.
template <typename L>
void MaskFor(const MaskQuery& query, TileList* tiles) {
  size_t left = 0;
  for (size_t i = 0; i < tiles->count; ++i) {
    const auto x = static_cast<float>(tiles->column[i] * 8 + query.column);
    const auto y = static_cast<float>(tiles->row[i] * 8 + query.row);
    const uint64_t occupied = tiles->occupied[i] & L::TileMask(x, y, query);
    tiles->occupied[left] = occupied;
    tiles->words[left] = tiles->words[i];
    tiles->column[left] = tiles->column[i];
    tiles->row[left] = tiles->row[i];
    left += occupied != 0 ? 1 : 0;
  }
  tiles->count = left;
}

// What the eight rows of a tile ask for: ahead[row] <= x * cos and x^2 <= rest[row].
struct TileRows {
  float ahead[8];
  float rest[8];
};
inline TileRows RowsFrom(float y, const MaskQuery& query) {
  TileRows rows{};
  for (int row = 0; row < 8; ++row) {
    const float at = y + static_cast<float>(row);
    rows.ahead[row] = -query.margin - at * query.sin;
    rows.rest[row] = query.radius_squared - at * at;
  }
  return rows;
}

}  // namespace
}  // namespace pheromone::field
