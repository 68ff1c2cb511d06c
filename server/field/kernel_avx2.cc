// Four nodes at a time.

#include <immintrin.h>

#include "server/field/kernel_lanes.h"
#include "server/field/kernel_table.h"

namespace pheromone::field {
namespace {

struct Avx2 {
  static constexpr int kWidth = 4;
  using V = __m256d;
  using W = __m256i;
  using M = __m256d;
  static V Set(double v) { return _mm256_set1_pd(v); }
  static V Load(const double* p) { return _mm256_load_pd(p); }
  static V FromInteger(__m256i v) {  // below 2^52
    const __m256d magic = _mm256_set1_pd(4503599627370496.0);
    return _mm256_sub_pd(_mm256_castsi256_pd(_mm256_or_si256(v, _mm256_castpd_si256(magic))),
                         magic);
  }
  static W LoadWords(const uint64_t* const* p) {
    const auto word = [p](int i) {
      return static_cast<long long>(__atomic_load_n(p[i], __ATOMIC_RELAXED));
    };
    return _mm256_set_epi64x(word(3), word(2), word(1), word(0));
  }
  static V TimeOf(W w) {
    return FromInteger(_mm256_and_si256(w, _mm256_set1_epi64x(static_cast<long long>(kTimeMask))));
  }
  static V LevelOf(W w) { return FromInteger(_mm256_srli_epi64(w, kTimeBits)); }
  static void Store(double* p, V v) { _mm256_storeu_pd(p, v); }
  static V Add(V a, V b) { return _mm256_add_pd(a, b); }
  static V Sub(V a, V b) { return _mm256_sub_pd(a, b); }
  static V Mul(V a, V b) { return _mm256_mul_pd(a, b); }
  static V Div(V a, V b) { return _mm256_div_pd(a, b); }
  static V Sqrt(V v) { return _mm256_sqrt_pd(v); }
  static V Min(V a, V b) { return _mm256_min_pd(a, b); }
  static V Max(V a, V b) { return _mm256_max_pd(a, b); }
  static V Truncate(V v) { return _mm256_cvtepi32_pd(_mm256_cvttpd_epi32(v)); }
  static M AtLeast(V a, V b) { return _mm256_cmp_pd(a, b, _CMP_GE_OQ); }
  static V Keep(M m, V v) { return _mm256_and_pd(m, v); }
  static V PowerOfTwo(V n) {
    const V e = _mm256_add_pd(_mm256_sub_pd(Set(1023), n), Set(4503599627370496.0));
    return _mm256_castsi256_pd(_mm256_slli_epi64(_mm256_castpd_si256(e), 52));
  }

  static uint64_t TileMask(float x, float y, const MaskQuery& query) {
    const __m256 eight = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256 at_x = _mm256_add_ps(_mm256_set1_ps(x), eight);
    const __m256 at_y = _mm256_add_ps(_mm256_set1_ps(y), eight);
    const __m256 along = _mm256_mul_ps(at_x, _mm256_set1_ps(query.cos));
    const __m256 square = _mm256_mul_ps(at_x, at_x);
    const __m256 aheads = _mm256_sub_ps(_mm256_set1_ps(-query.margin),
                                        _mm256_mul_ps(at_y, _mm256_set1_ps(query.sin)));
    const __m256 rests =
        _mm256_sub_ps(_mm256_set1_ps(query.radius_squared), _mm256_mul_ps(at_y, at_y));
    uint64_t mask = 0;
#pragma GCC unroll 8
    for (int row = 0; row < 8; ++row) {
      const __m256i which = _mm256_set1_epi32(row);
      const __m256 ahead =
          _mm256_cmp_ps(along, _mm256_permutevar8x32_ps(aheads, which), _CMP_GE_OQ);
      const __m256 near = _mm256_cmp_ps(square, _mm256_permutevar8x32_ps(rests, which), _CMP_LE_OQ);
      const int bits = _mm256_movemask_ps(_mm256_and_ps(ahead, near));
      mask |= static_cast<uint64_t>(static_cast<unsigned>(bits)) << (8 * row);
    }
    return mask;
  }
};

}  // namespace

const Kernel kAvx2Kernel = {"avx2", WeighFor<Avx2>, MaskFor<Avx2>};

}  // namespace pheromone::field
