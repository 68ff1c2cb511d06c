// Eight nodes at a time.

#include <immintrin.h>

#include "server/field/kernel_lanes.h"
#include "server/field/kernel_table.h"

namespace pheromone::field {
namespace {

struct Avx512 {
  static constexpr int kWidth = 8;
  using V = __m512d;
  using W = __m512i;
  using M = __mmask8;
  static V Set(double v) { return _mm512_set1_pd(v); }
  static V Load(const double* p) { return _mm512_load_pd(p); }
  static W LoadWords(const uint64_t* const* p) {
    const auto word = [p](int i) {
      return static_cast<long long>(__atomic_load_n(p[i], __ATOMIC_RELAXED));
    };
    return _mm512_set_epi64(word(7), word(6), word(5), word(4), word(3), word(2), word(1), word(0));
  }
  static V TimeOf(W w) {
    return _mm512_cvtepi64_pd(
        _mm512_and_si512(w, _mm512_set1_epi64(static_cast<long long>(kTimeMask))));
  }
  static V LevelOf(W w) { return _mm512_cvtepi64_pd(_mm512_srli_epi64(w, kTimeBits)); }
  static void Store(double* p, V v) { _mm512_storeu_pd(p, v); }
  static V Add(V a, V b) { return _mm512_add_pd(a, b); }
  static V Sub(V a, V b) { return _mm512_sub_pd(a, b); }
  static V Mul(V a, V b) { return _mm512_mul_pd(a, b); }
  static V Div(V a, V b) { return _mm512_div_pd(a, b); }
  static V Sqrt(V v) { return _mm512_sqrt_pd(v); }
  static V Min(V a, V b) { return _mm512_min_pd(a, b); }
  static V Max(V a, V b) { return _mm512_max_pd(a, b); }
  static V Truncate(V v) { return _mm512_cvtepi32_pd(_mm512_cvttpd_epi32(v)); }
  static M AtLeast(V a, V b) { return _mm512_cmp_pd_mask(a, b, _CMP_GE_OQ); }
  static V Keep(M m, V v) { return _mm512_maskz_mov_pd(m, v); }
  static V PowerOfTwo(V n) {
    const __m512i e = _mm512_cvtpd_epi64(_mm512_sub_pd(Set(1023), n));
    return _mm512_castsi512_pd(_mm512_slli_epi64(e, 52));
  }

  // Two rows of a tile in one vector.
  static uint64_t TileMask(float x, float y, const MaskQuery& query) {
    const __m512 eight = _mm512_setr_ps(0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7);
    const __m512 at_x = _mm512_add_ps(_mm512_set1_ps(x), eight);
    const __m512 at_y = _mm512_add_ps(_mm512_set1_ps(y), eight);
    const __m512 along = _mm512_mul_ps(at_x, _mm512_set1_ps(query.cos));
    const __m512 square = _mm512_mul_ps(at_x, at_x);
    const __m512 aheads = _mm512_sub_ps(_mm512_set1_ps(-query.margin),
                                        _mm512_mul_ps(at_y, _mm512_set1_ps(query.sin)));
    const __m512 rests =
        _mm512_sub_ps(_mm512_set1_ps(query.radius_squared), _mm512_mul_ps(at_y, at_y));
    uint64_t mask = 0;
#pragma GCC unroll 4
    for (int i = 0; i < 4; ++i) {
      const __m512i which =
          _mm512_mask_blend_epi32(0xFF00, _mm512_set1_epi32(2 * i), _mm512_set1_epi32(2 * i + 1));
      const __mmask16 ahead =
          _mm512_cmp_ps_mask(along, _mm512_permutexvar_ps(which, aheads), _CMP_GE_OQ);
      const __mmask16 bits =
          _mm512_mask_cmp_ps_mask(ahead, square, _mm512_permutexvar_ps(which, rests), _CMP_LE_OQ);
      mask |= static_cast<uint64_t>(bits) << (16 * i);
    }
    return mask;
  }
};

}  // namespace

const Kernel kAvx512Kernel = {"avx512", WeighFor<Avx512>, MaskFor<Avx512>};

}  // namespace pheromone::field
