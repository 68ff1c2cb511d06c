// Two rows of a tile at a time.

#include <immintrin.h>
#include <stddef.h>

#include "server/field/diffusion_kernel.h"
#include "server/field/diffusion_lanes.h"

namespace pheromone::field {
namespace {

struct Avx512 {
  static constexpr int kRows = 2;
  static constexpr uint32_t kAll = 0xFFFF;
  using V = __m512i;
  using M = __mmask16;
  struct X {
    __m512i low;   // in the low half of each lane
    __m512i high;  // in the high half
  };
  using K = __m512i;
  using Sums = __m512i;

  static X PrepareExchange(uint32_t exchange_q16) {
    const V low = Set(static_cast<int32_t>(exchange_q16));
    return {low, _mm512_slli_epi32(low, 16)};
  }
  static K PrepareKeep(uint32_t keep_q32) { return Set(static_cast<int32_t>(keep_q32)); }

  static V Set(int32_t number) { return _mm512_set1_epi32(number); }
  static const void* Row(const void* tile, int row) {
    return static_cast<const __m256i*>(tile) + row;
  }
  static V Load(const void* tile, int row) { return _mm512_loadu_si512(Row(tile, row)); }
  static void Store(void* tile, int row, V v) {
    _mm512_storeu_si512(static_cast<__m256i*>(tile) + row, v);
  }
  static V LoadAbove(const void* tile, const void* above, int row) {
    if (row < 6) {
      return Load(tile, row + 1);
    }
    const V last =
        _mm512_castsi256_si512(_mm256_load_si256(static_cast<const __m256i*>(Row(tile, 7))));
    return _mm512_inserti64x4(last, _mm256_load_si256(static_cast<const __m256i*>(above)), 1);
  }
  static V OneUp(V a, V b) { return _mm512_alignr_epi64(b, a, 4); }
  static V PushFirst(V v, const uint32_t* numbers) {
    const V from = _mm512_setr_epi32(16, 0, 1, 2, 3, 4, 5, 6, 17, 8, 9, 10, 11, 12, 13, 14);
    const __m128i two = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(numbers));
    return _mm512_permutex2var_epi32(v, from, _mm512_castsi128_si512(two));
  }
  static V PushLast(V v, V other) {
    const V from = _mm512_setr_epi32(1, 2, 3, 4, 5, 6, 7, 16, 9, 10, 11, 12, 13, 14, 15, 24);
    return _mm512_permutex2var_epi32(v, from, other);
  }

  // In the lower eight lanes, by halves of four rows in which the first or the last column is
  // wanted.
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
    return _mm512_castsi256_si512(
        _mm256_set_m128i(HalfColumn<kColumn>(tile, 4), HalfColumn<kColumn>(tile, 0)));
  }

  // As in diffusion_avx2.cc.
  static V Flux(V a, V b, const X& exchange) {
    const V difference = _mm512_sub_epi32(a, b);
    const V size = _mm512_abs_epi32(difference);
    const V flux = _mm512_add_epi32(_mm512_madd_epi16(size, exchange.high),
                                    _mm512_mulhi_epu16(size, exchange.low));
    const V zero = _mm512_setzero_si512();
    return _mm512_mask_sub_epi32(flux, _mm512_cmplt_epi32_mask(difference, zero), zero, flux);
  }
  static V Scale(V v, K keep) {
    const V even = _mm512_srli_epi64(_mm512_mul_epu32(v, keep), 32);
    const V odd = _mm512_mul_epu32(_mm512_srli_epi64(v, 32), keep);
    return _mm512_mask_mov_epi32(even, 0xAAAA, odd);
  }
  static V Add(V a, V b) { return _mm512_add_epi32(a, b); }
  static V Sub(V a, V b) { return _mm512_sub_epi32(a, b); }
  static M Choose(uint32_t bits) { return static_cast<M>(bits); }
  static M Greater(V a, V b) { return _mm512_cmpgt_epi32_mask(a, b); }
  static V Keep(M m, V v) { return _mm512_maskz_mov_epi32(m, v); }
  static V Drop(M m, V v) { return _mm512_mask_mov_epi32(v, m, _mm512_setzero_si512()); }
  static uint32_t Bits(M m) { return m; }
  static Sums Zero() { return _mm512_setzero_si512(); }
  static Sums AddTo(Sums sum, V v) {
    const V even = _mm512_and_si512(v, _mm512_set1_epi64(0xFFFFFFFF));
    return _mm512_add_epi64(sum, _mm512_add_epi64(even, _mm512_srli_epi64(v, 32)));
  }
  static uint64_t Total(Sums sum) { return static_cast<uint64_t>(_mm512_reduce_add_epi64(sum)); }
};

}  // namespace

const DiffusionKernel kAvx512Diffusion = {"avx512", StepFor<Avx512>};

}  // namespace pheromone::field
