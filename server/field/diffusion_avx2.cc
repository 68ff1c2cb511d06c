// A row of a tile at a time.

#include <immintrin.h>
#include <stddef.h>

#include "server/field/diffusion_kernel.h"
#include "server/field/diffusion_lanes.h"

namespace pheromone::field {
namespace {

struct Avx2 {
  static constexpr int kRows = 1;
  static constexpr uint32_t kAll = 0xFF;
  using V = __m256i;
  using M = __m256i;  // all ones in a lane that is chosen
  struct X {
    __m256i low;   // in the low half of each lane
    __m256i high;  // in the high half
  };
  using K = __m256i;
  using Sums = __m256i;

  static X PrepareExchange(uint32_t exchange_q16) {
    const __m256i low = _mm256_set1_epi32(static_cast<int>(exchange_q16));
    return {low, _mm256_slli_epi32(low, 16)};
  }
  static K PrepareKeep(uint32_t keep_q32) { return Set(static_cast<int32_t>(keep_q32)); }

  static V Set(int32_t number) { return _mm256_set1_epi32(number); }
  static V Load(const void* tile, int row) {
    return _mm256_load_si256(static_cast<const __m256i*>(tile) + row);
  }
  static void Store(void* tile, int row, V v) {
    _mm256_store_si256(static_cast<__m256i*>(tile) + row, v);
  }

  static V LoadAbove(const void* tile, const void* above, int row) {
    return row < 7 ? Load(tile, row + 1) : Load(above, 0);
  }
  static V OneUp(V a, V) { return a; }
  static V PushFirst(V v, const uint32_t* number) {
    const V moved = _mm256_permutevar8x32_epi32(v, _mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6));
    return _mm256_blend_epi32(moved, Set(static_cast<int32_t>(*number)), 0x01);
  }
  static V PushLast(V v, V other) {
    return _mm256_permutevar8x32_epi32(_mm256_blend_epi32(v, other, 0x01),
                                       _mm256_setr_epi32(1, 2, 3, 4, 5, 6, 7, 0));
  }

  // The left or the right half of four rows, of which the first or the last column is wanted.
  template <int kColumn>
  static __m128i HalfColumn(const void* tile, int row) {
    const auto half = [&](int r) {
      return _mm_load_si128(static_cast<const __m128i*>(tile) + ptrdiff_t{2} * r + kColumn / 4);
    };
    const __m128i r0 = half(row);
    const __m128i r1 = half(row + 1);
    const __m128i r2 = half(row + 2);
    const __m128i r3 = half(row + 3);
    if (kColumn == 0) {
      return _mm_unpacklo_epi64(_mm_unpacklo_epi32(r0, r1), _mm_unpacklo_epi32(r2, r3));
    }
    return _mm_unpackhi_epi64(_mm_unpackhi_epi32(r0, r1), _mm_unpackhi_epi32(r2, r3));
  }
  template <int kColumn>
  static V Column(const void* tile) {
    static_assert(kColumn == 0 || kColumn == 7);
    return _mm256_set_m128i(HalfColumn<kColumn>(tile, 4), HalfColumn<kColumn>(tile, 0));
  }

  // With |a - b| = 65 536 h + l: |flux| = h x + floor(l x / 65 536). h is below 2^15, so the signed
  // product of halves holds h x; the other half of `high` is 0.
  static V Flux(V a, V b, const X& exchange) {
    const V difference = _mm256_sub_epi32(a, b);
    const V size = _mm256_abs_epi32(difference);
    const V flux = _mm256_add_epi32(_mm256_madd_epi16(size, exchange.high),
                                    _mm256_mulhi_epu16(size, exchange.low));
    return _mm256_sign_epi32(flux, difference);
  }
  static V Scale(V v, K keep) {
    const V even = _mm256_srli_epi64(_mm256_mul_epu32(v, keep), 32);
    const V odd = _mm256_mul_epu32(_mm256_srli_epi64(v, 32), keep);
    return _mm256_blend_epi32(even, odd, 0xAA);
  }
  static V Add(V a, V b) { return _mm256_add_epi32(a, b); }
  static V Sub(V a, V b) { return _mm256_sub_epi32(a, b); }
  static M Choose(uint32_t bits) {
    const __m256i bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i all = Set(static_cast<int32_t>(bits));
    return _mm256_cmpeq_epi32(_mm256_and_si256(all, bit), bit);
  }
  static M Greater(V a, V b) { return _mm256_cmpgt_epi32(a, b); }
  static V Keep(M m, V v) { return _mm256_and_si256(m, v); }
  static V Drop(M m, V v) { return _mm256_andnot_si256(m, v); }
  static uint32_t Bits(M m) {
    return static_cast<uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(m)));
  }
  static Sums Zero() { return _mm256_setzero_si256(); }
  static Sums AddTo(Sums sum, V v) {
    const V even = _mm256_and_si256(v, _mm256_set1_epi64x(0xFFFFFFFF));
    return _mm256_add_epi64(sum, _mm256_add_epi64(even, _mm256_srli_epi64(v, 32)));
  }
  static uint64_t Total(Sums sum) {
    const __m128i half =
        _mm_add_epi64(_mm256_castsi256_si128(sum), _mm256_extracti128_si256(sum, 1));
    return static_cast<uint64_t>(_mm_cvtsi128_si64(half)) +
           static_cast<uint64_t>(_mm_extract_epi64(half, 1));
  }
};

}  // namespace

const DiffusionKernel kAvx2Diffusion = {"avx2", StepFor<Avx2>};

}  // namespace pheromone::field
