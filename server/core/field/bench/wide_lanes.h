// The loops of wide.h, written once. `L` is a register of L::kWidth floats and what can be done
// with it. The plain loops of the dense grid are for the compiler to vectorise: their files are
// compiled with -O3 for their instruction set.
#pragma once

#include "server/core/field/bench/wide.h"

namespace pheromone::field::bench {

// The processor's own prefetching ends at each page of 4 KiB.
constexpr int32_t kScanAhead = 8192 / sizeof(uint32_t);

template <typename L>
float SumOf(typename L::V v) {
  float lane[L::kWidth];
  L::Store(lane, v);
  float sum = 0;
  for (const float part : lane) {
    sum += part;
  }
  return sum;
}

template <typename L, bool kSkip>
void ScanFor(const ScanQuery& query, float* sum) {
  using V = typename L::V;
  V sum_left = L::Set(0);
  V sum_right = L::Set(0);
  const V cos = L::Set(query.cos);
  const V left_x = L::Set(query.antenna_x[0]);
  const V right_x = L::Set(query.antenna_x[1]);
  const V zero_at = L::Set(query.reach * query.inverse_sigma);
  const V slope = L::Set(query.inverse_sigma);
  const V reach_squared = L::Set(query.reach * query.reach);
  const V step = L::Set(L::kWidth);
  for (int32_t row = 0; row < query.rows; ++row) {
    const auto y = static_cast<float>(row);
    const V ahead_of_row = L::Set((y - query.centre_y) * query.sin - query.centre_x * query.cos);
    const float left_y = y - query.antenna_y[0];
    const float right_y = y - query.antenna_y[1];
    const V left_y2 = L::Set(left_y * left_y);
    const V right_y2 = L::Set(right_y * right_y);
    const uint32_t* words =
        query.words + static_cast<size_t>(row) * static_cast<size_t>(query.stride);
    V x = L::Count();
    for (int32_t column = 0; column < query.stride; column += L::kWidth, x = L::Add(x, step)) {
      const typename L::W word = L::Load(words + column);
      __builtin_prefetch(words + column + kScanAhead);
      const V dx_left = L::Sub(x, left_x);
      const V dx_right = L::Sub(x, right_x);
      const V d2_left = L::MulAdd(dx_left, dx_left, left_y2);
      const V d2_right = L::MulAdd(dx_right, dx_right, right_y2);
      typename L::M counts = L::NotNegative(L::MulAdd(x, cos, ahead_of_row));
      if (kSkip) {
        counts = L::And(counts, L::AtMost(L::Min(d2_left, d2_right), reach_squared));
        if (L::None(counts)) {
          L::Use(word);
          continue;
        }
      }
      const V level = L::Keep(counts, L::Level(word, query.now_ticks));
      const V mu_left = L::Clamp01(L::NegMulAdd(L::Sqrt(d2_left), slope, zero_at));
      const V mu_right = L::Clamp01(L::NegMulAdd(L::Sqrt(d2_right), slope, zero_at));
      sum_left = L::MulAdd(level, mu_left, sum_left);
      sum_right = L::MulAdd(level, mu_right, sum_right);
    }
  }
  sum[0] = SumOf<L>(sum_left);
  sum[1] = SumOf<L>(sum_right);
}

// Internal linkage: each instruction set has its own copy of the plain loops.
static inline void EvaporateGrid(float* grid, size_t count, float keep) {
  for (size_t i = 0; i < count; ++i) {
    grid[i] *= keep;
  }
}

static inline void StampGrid(float* grid, size_t stride, const float* stamp, int32_t side) {
  for (int32_t row = 0; row < side; ++row) {
    float* to = grid + static_cast<size_t>(row) * stride;
    const float* from = stamp + static_cast<size_t>(row) * static_cast<size_t>(side);
    for (int32_t column = 0; column < side; ++column) {
      to[column] = to[column] > from[column] ? to[column] : from[column];
    }
  }
}

static inline void StencilGrid(const float* from, float* to, int32_t side, float rate) {
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

template <typename L>
constexpr Wide WideOf(const char* name) {
  return {name, ScanFor<L, false>, ScanFor<L, true>, EvaporateGrid, StampGrid, StencilGrid};
}

}  // namespace pheromone::field::bench
