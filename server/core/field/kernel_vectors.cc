// The inner loops of a query in vectors; kernel_scalar.cc has the same for one node at a time.
//
// Written once, with Highway, which includes this file for each instruction set that it knows on
// this family of processors. All its operations are rounded as in IEEE 754; MulAdd is not used,
// because it rounds once where the definition rounds twice.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/core/field/kernel_vectors.cc"
#include "server/core/field/kernel_targets.h"
// In this order: the first of them includes this file again.
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <type_traits>

#include "server/core/field/kernel.h"
#include "server/core/field/kernel_table.h"

#if HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128

HWY_BEFORE_NAMESPACE();
namespace pheromone::field {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, 8>;
using Words = hn::RebindToUnsigned<D>;
using V = hn::Vec<D>;
constexpr size_t kWidth = HWY_LANES(double);
constexpr double kTwo52 = 4503599627370496.0;  // the last bit of its mantissa is 1

// One load for each word, as a writer may be changing it.
template <class DW>
HWY_INLINE hn::Vec<DW> LoadWords(DW d, const uint64_t* const* words) {
  constexpr size_t kCount = hn::MaxLanes(DW());
  if constexpr (kCount == 2) {
    // Compilers do this well with two registers; two Set and InterleaveLower take longer.
    using Pair = uint64_t __attribute__((vector_size(16)));
    const Pair pair = {__atomic_load_n(words[0], __ATOMIC_RELAXED),
                       __atomic_load_n(words[1], __ATOMIC_RELAXED)};
    return hn::Load(d, reinterpret_cast<const uint64_t*>(&pair));
  } else {
    const hn::Half<DW> half;
    return hn::Combine(d, LoadWords(half, words + kCount / 2), LoadWords(half, words));
  }
}

// Below 2^52.
HWY_INLINE V FromInteger(hn::Vec<Words> v) {
  const V two52 = hn::Set(D(), kTwo52);
  return hn::Sub(hn::BitCast(D(), hn::Or(v, hn::BitCast(Words(), two52))), two52);
}

// 2^-x, as kernel.h defines it.
HWY_INLINE V Exp2Minus(V x) {
  const D d;
  x = hn::Min(x, hn::Set(d, kExp2Most));
  const V n = hn::Trunc(x);
  const V g = hn::Sub(hn::Sub(x, n), hn::Set(d, 0.5));
  V p = hn::Set(d, kExp2Coefficient[kExp2Terms - 1]);
  for (int k = kExp2Terms - 2; k >= 0; --k) {
    p = hn::Add(hn::Mul(p, g), hn::Set(d, kExp2Coefficient[k]));
  }
  const V exponent = hn::Add(hn::Sub(hn::Set(d, 1023), n), hn::Set(d, kTwo52));
  return hn::Mul(p, hn::BitCast(d, hn::ShiftLeft<52>(hn::BitCast(Words(), exponent))));
}

template <bool kExponential, bool kGaussian, size_t kAntennas>
void Weigh(const KernelLaw& law, const KernelQuery& query, Candidates* candidates, int64_t* sum) {
  const D d;
  const size_t count = candidates->count;
  static constexpr uint64_t kNothing = 0;
  for (size_t i = count; i % kWidth != 0; ++i) {
    candidates->word[i] = &kNothing;
    candidates->x[i] = 0;
    candidates->y[i] = 0;
  }
  const V now = hn::Set(d, static_cast<double>(query.now_ms));
  const V zero = hn::Zero(d);
  const V half = hn::Set(d, 0.5);
  const V one = hn::Set(d, 1);
  const V tau = hn::Set(d, law.tau_ms);
  const V one_q16 = hn::Set(d, 65536);
  // Whole numbers below 2^38 * 512: exact in any order.
  V total[kAntennas];
  for (V& t : total) {
    t = zero;
  }
  for (size_t i = 0; i < count; i += kWidth) {
    const V x = hn::Load(d, candidates->x + i);
    const V y = hn::Load(d, candidates->y + i);
    const V ahead = hn::Add(hn::Mul(x, hn::Set(d, query.cos)), hn::Mul(y, hn::Set(d, query.sin)));
    const auto words = LoadWords(Words(), candidates->word + i);
    V level = FromInteger(hn::ShiftRight<kTimeBits>(words));
    const V time = FromInteger(hn::And(words, hn::Set(Words(), kTimeMask)));
    const V dt = hn::Max(hn::Sub(now, time), zero);
    if (kExponential) {
      const V left = hn::Mul(level, Exp2Minus(hn::Div(dt, tau)));
      level = hn::Trunc(hn::Add(left, half));
    } else {
      // floor(scaled / tau) in whole numbers. The product is off by less than one, which the exact
      // remainder corrects; a division would take longer. More steps than a level has are
      // equivalent to all.
      const V scaled = hn::Mul(dt, hn::Set(d, law.scale));
      const V near =
          hn::Trunc(hn::Min(hn::Mul(scaled, hn::Set(d, law.per_tau)), hn::Set(d, 4194304)));
      const V rest = hn::Sub(scaled, hn::Mul(near, tau));
      const V more = hn::IfThenElseZero(hn::Ge(rest, tau), one);
      const V less = hn::IfThenZeroElse(hn::Ge(rest, zero), one);
      const V whole = hn::Sub(hn::Add(near, more), less);
      level = hn::Max(hn::Sub(level, hn::Mul(whole, hn::Set(d, law.unit))), zero);
    }
    level = hn::IfThenElseZero(hn::Ge(ahead, zero), level);
    for (size_t a = 0; a < kAntennas; ++a) {
      const V dx = hn::Sub(x, hn::Set(d, query.antenna_x[a]));
      const V dy = hn::Sub(y, hn::Set(d, query.antenna_y[a]));
      const V d2 = hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
      V mu;
      if (kGaussian) {
        const V gaussian = Exp2Minus(hn::Mul(d2, hn::Set(d, law.exponent)));
        mu = hn::Trunc(hn::Add(hn::Mul(gaussian, one_q16), half));
        mu = hn::IfThenElseZero(hn::Ge(hn::Set(d, law.reach_um2), d2), mu);
      } else {
        const V slope =
            hn::Mul(hn::Sub(hn::Set(d, law.reach_um), hn::Sqrt(d2)), hn::Set(d, law.slope));
        mu = hn::Trunc(hn::Min(hn::Max(hn::Add(slope, half), zero), one_q16));
      }
      total[a] = hn::Add(total[a], hn::Mul(level, mu));
    }
  }
  for (size_t a = 0; a < kAntennas; ++a) {
    sum[a] += static_cast<int64_t>(hn::GetLane(hn::SumOfLanes(d, total[a])));
  }
}

template <size_t kAntennas>
void WeighAny(const KernelLaw& law, const KernelQuery& query, Candidates* candidates,
              int64_t* sum) {
  if (law.exponential) {
    law.gaussian ? Weigh<true, true, kAntennas>(law, query, candidates, sum)
                 : Weigh<true, false, kAntennas>(law, query, candidates, sum);
  } else {
    law.gaussian ? Weigh<false, true, kAntennas>(law, query, candidates, sum)
                 : Weigh<false, false, kAntennas>(law, query, candidates, sum);
  }
}

void WeighFor(const KernelLaw& law, const KernelQuery& query, Candidates* candidates, int antennas,
              int64_t* sum) {
  antennas == 2 ? WeighAny<2>(law, query, candidates, sum)
                : WeighAny<1>(law, query, candidates, sum);
}

// A tile's nodes in vectors: two rows, one, or half of one.
using F = hn::CappedTag<float, 16>;
using Columns = hn::RebindToSigned<F>;
constexpr size_t kNodes = HWY_LANES(float);

HWY_ALIGN constexpr float kColumnOf[] = {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7};
HWY_ALIGN constexpr int32_t kRowOf[] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};

// Bit i: lane i of both.
HWY_INLINE uint64_t BitsOf(hn::Mask<F> a, hn::Mask<F> b) {
  std::conditional_t<kNodes == 16, uint16_t, uint8_t> bits = 0;
  hn::StoreMaskBits(F(), hn::And(a, b), reinterpret_cast<uint8_t*>(&bits));
  return bits;
}

// Bit 8 * row + i: the node at (x + i, y + row) can contribute.
HWY_INLINE uint64_t TileMask(float x, float y, const MaskQuery& query) {
  const F f;
  uint64_t mask = 0;
  if constexpr (kNodes >= 8) {
    const auto columns = hn::Load(f, kColumnOf);
    const auto at_x = hn::Add(hn::Set(f, x), columns);
    const auto at_y = hn::Add(hn::Set(f, y), columns);
    const auto along = hn::Mul(at_x, hn::Set(f, query.cos));
    const auto square = hn::Mul(at_x, at_x);
    // A lane for each row, moved to where that row's nodes are.
    const auto aheads = hn::Sub(hn::Set(f, -query.margin), hn::Mul(at_y, hn::Set(f, query.sin)));
    const auto rests = hn::Sub(hn::Set(f, query.radius_squared), hn::Mul(at_y, at_y));
    const auto first = hn::Load(Columns(), kRowOf);
#pragma GCC unroll 8
    for (int row = 0; row < 8; row += static_cast<int>(kNodes) / 8) {
      const auto rows = hn::IndicesFromVec(f, hn::Add(first, hn::Set(Columns(), row)));
      mask |= BitsOf(hn::Ge(along, hn::TableLookupLanes(aheads, rows)),
                     hn::Le(square, hn::TableLookupLanes(rests, rows)))
              << (8 * row);
    }
  } else {
    const auto left_x = hn::Add(hn::Set(f, x), hn::Load(f, kColumnOf));
    const auto right_x = hn::Add(hn::Set(f, x + 4), hn::Load(f, kColumnOf));
    const auto cos = hn::Set(f, query.cos);
    for (int row = 0; row < 8; ++row) {
      const float at_y = y + static_cast<float>(row);
      const auto ahead = hn::Set(f, -query.margin - at_y * query.sin);
      const auto rest = hn::Set(f, query.radius_squared - at_y * at_y);
      const uint64_t left =
          BitsOf(hn::Ge(hn::Mul(left_x, cos), ahead), hn::Le(hn::Mul(left_x, left_x), rest));
      const uint64_t right =
          BitsOf(hn::Ge(hn::Mul(right_x, cos), ahead), hn::Le(hn::Mul(right_x, right_x), rest));
      mask |= (left | right << 4) << (8 * row);
    }
  }
  return mask;
}

// No branch depends on the contents of tiles: it could not be predicted.
void MaskFor(const MaskQuery& query, TileList* tiles) {
  size_t left = 0;
  for (size_t i = 0; i < tiles->count; ++i) {
    const auto x = static_cast<float>(tiles->column[i] * 8 + query.column);
    const auto y = static_cast<float>(tiles->row[i] * 8 + query.row);
    const uint64_t occupied = tiles->occupied[i] & TileMask(x, y, query);
    tiles->occupied[left] = occupied;
    tiles->words[left] = tiles->words[i];
    tiles->column[left] = tiles->column[i];
    tiles->row[left] = tiles->row[i];
    left += occupied != 0 ? 1 : 0;
  }
  tiles->count = left;
}

constexpr Kernel kVectorKernel = {PHEROMONE_TARGET_NAME, WeighFor, MaskFor};

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace pheromone::field
HWY_AFTER_NAMESPACE();

#endif

#if HWY_ONCE
namespace pheromone::field {

void AppendVectorKernels(KernelList* list) {
  static const Compiled<Kernel> compiled[] = PHEROMONE_COMPILED(kVectorKernel);
  AppendRunning(compiled, list);
}

}  // namespace pheromone::field
#endif
