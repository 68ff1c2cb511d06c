#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/core/field/bench/wide.cc"
#include "server/core/field/kernel_targets.h"
// In this order: the first of them includes this file again.
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/core/field/bench/wide.h"

HWY_BEFORE_NAMESPACE();
namespace pheromone::field::bench {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, kWidestRegister>;
using Words = hn::RebindToUnsigned<D>;
using V = hn::Vec<D>;
constexpr int32_t kWidth = HWY_LANES(float);

// The processor's own prefetching ends at each page of 4 KiB.
constexpr int32_t kScanAhead = 8192 / sizeof(uint32_t);

HWY_INLINE V LevelOf(hn::Vec<Words> word, uint32_t now_ticks) {
  const Words d;
  const hn::RebindToSigned<D> counts;
  const auto since = hn::And(hn::Sub(hn::Set(d, now_ticks), word), hn::Set(d, kTickMask));
  const auto left =
      hn::Sub(hn::ShiftRight<kTickBits>(word), hn::ShiftRight<kTicksPerTauBits>(since));
  return hn::ConvertTo(D(), hn::Max(hn::BitCast(counts, left), hn::Zero(counts)));
}

HWY_INLINE V Clamp01(V v) {
  return hn::Min(hn::Max(v, hn::Zero(D())), hn::Set(D(), 1));
}

template <bool kSkip>
void ScanFor(const ScanQuery& query, float* sum) {
  const D d;
  V sum_left = hn::Zero(d);
  V sum_right = hn::Zero(d);
  const V cos = hn::Set(d, query.cos);
  const V left_x = hn::Set(d, query.antenna_x[0]);
  const V right_x = hn::Set(d, query.antenna_x[1]);
  const V zero_at = hn::Set(d, query.reach * query.inverse_sigma);
  const V slope = hn::Set(d, query.inverse_sigma);
  const V reach_squared = hn::Set(d, query.reach * query.reach);
  const V step = hn::Set(d, kWidth);
  for (int32_t row = 0; row < query.rows; ++row) {
    const auto y = static_cast<float>(row);
    const V ahead_of_row =
        hn::Set(d, (y - query.centre_y) * query.sin - query.centre_x * query.cos);
    const float left_y = y - query.antenna_y[0];
    const float right_y = y - query.antenna_y[1];
    const V left_y2 = hn::Set(d, left_y * left_y);
    const V right_y2 = hn::Set(d, right_y * right_y);
    const uint32_t* words =
        query.words + static_cast<size_t>(row) * static_cast<size_t>(query.stride);
    V x = hn::Iota(d, 0);
    for (int32_t column = 0; column < query.stride; column += kWidth, x = hn::Add(x, step)) {
      __builtin_prefetch(words + column + kScanAhead);
      const V dx_left = hn::Sub(x, left_x);
      const V dx_right = hn::Sub(x, right_x);
      const V d2_left = hn::MulAdd(dx_left, dx_left, left_y2);
      const V d2_right = hn::MulAdd(dx_right, dx_right, right_y2);
      auto counts = hn::Ge(hn::MulAdd(x, cos, ahead_of_row), hn::Zero(d));
      if (kSkip) {
        counts = hn::And(counts, hn::Le(hn::Min(d2_left, d2_right), reach_squared));
        if (hn::AllFalse(d, counts)) {
          continue;
        }
      }
      const auto word = hn::LoadU(Words(), words + column);
      const V level = hn::IfThenElseZero(counts, LevelOf(word, query.now_ticks));
      const V mu_left = Clamp01(hn::NegMulAdd(hn::Sqrt(d2_left), slope, zero_at));
      const V mu_right = Clamp01(hn::NegMulAdd(hn::Sqrt(d2_right), slope, zero_at));
      sum_left = hn::MulAdd(level, mu_left, sum_left);
      sum_right = hn::MulAdd(level, mu_right, sum_right);
    }
  }
  sum[0] = hn::GetLane(hn::SumOfLanes(d, sum_left));
  sum[1] = hn::GetLane(hn::SumOfLanes(d, sum_right));
}

// These are for the compiler to vectorise, at -O3.

void EvaporateGrid(float* grid, size_t count, float keep) {
  for (size_t i = 0; i < count; ++i) {
    grid[i] *= keep;
  }
}

void StampGrid(float* grid, size_t stride, const float* stamp, int32_t side) {
  for (int32_t row = 0; row < side; ++row) {
    float* to = grid + static_cast<size_t>(row) * stride;
    const float* from = stamp + static_cast<size_t>(row) * static_cast<size_t>(side);
    for (int32_t column = 0; column < side; ++column) {
      to[column] = to[column] > from[column] ? to[column] : from[column];
    }
  }
}

void StencilGrid(const float* from, float* to, int32_t side, float rate) {
  const auto stride = static_cast<size_t>(side);
  for (size_t row = 1; row + 1 < stride; ++row) {
    const float* __restrict below = from + (row - 1) * stride;
    const float* __restrict centre = below + stride;
    const float* __restrict above = centre + stride;
    float* __restrict out = to + row * stride;
    for (size_t i = 1; i + 1 < stride; ++i) {
      const float around = centre[i - 1] + centre[i + 1] + below[i] + above[i];
      out[i] = centre[i] + rate * (around - 4 * centre[i]);
    }
  }
}

constexpr Wide kWide = {PHEROMONE_TARGET_NAME, ScanFor<false>, ScanFor<true>,
                        EvaporateGrid,         StampGrid,      StencilGrid};

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace pheromone::field::bench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pheromone::field::bench {

std::vector<const Wide*> AllWides() {
  static const Compiled<Wide> compiled[] = PHEROMONE_COMPILED(kWide);
  std::vector<const Wide*> wides = {&HWY_STATIC_DISPATCH(kWide)};
  for (const Compiled<Wide>& each : compiled) {
    if (each.kernel != nullptr && each.target != HWY_STATIC_TARGET && Runs(each.target)) {
      wides.push_back(each.kernel);
    }
  }
  return wides;
}

const Wide& BestWide() {
  static const Wide& best = *AllWides().back();
  return best;
}

}  // namespace pheromone::field::bench
#endif
