// Two nodes at a time, with what every x86-64 has.

#include <emmintrin.h>

#include "server/field/kernel_lanes.h"
#include "server/field/kernel_table.h"

namespace pheromone::field {
namespace {

struct Sse2 {
  static constexpr int kWidth = 2;
  using V = __m128d;
  using W = __m128i;
  using M = __m128d;
  static V Set(double v) { return _mm_set1_pd(v); }
  static V Load(const double* p) { return _mm_load_pd(p); }
  static V FromInteger(__m128i v) {  // below 2^52
    const __m128d magic = _mm_set1_pd(4503599627370496.0);
    return _mm_sub_pd(_mm_castsi128_pd(_mm_or_si128(v, _mm_castpd_si128(magic))), magic);
  }
  static W LoadWords(const uint64_t* const* p) {
    return _mm_set_epi64x(static_cast<long long>(__atomic_load_n(p[1], __ATOMIC_RELAXED)),
                          static_cast<long long>(__atomic_load_n(p[0], __ATOMIC_RELAXED)));
  }
  static V TimeOf(W w) {
    return FromInteger(_mm_and_si128(w, _mm_set1_epi64x(static_cast<long long>(kTimeMask))));
  }
  static V LevelOf(W w) { return FromInteger(_mm_srli_epi64(w, kTimeBits)); }
  static void Store(double* p, V v) { _mm_storeu_pd(p, v); }
  static V Add(V a, V b) { return _mm_add_pd(a, b); }
  static V Sub(V a, V b) { return _mm_sub_pd(a, b); }
  static V Mul(V a, V b) { return _mm_mul_pd(a, b); }
  static V Div(V a, V b) { return _mm_div_pd(a, b); }
  static V Sqrt(V v) { return _mm_sqrt_pd(v); }
  static V Min(V a, V b) { return _mm_min_pd(a, b); }
  static V Max(V a, V b) { return _mm_max_pd(a, b); }
  static V Truncate(V v) { return _mm_cvtepi32_pd(_mm_cvttpd_epi32(v)); }
  static M AtLeast(V a, V b) { return _mm_cmpge_pd(a, b); }
  static V Keep(M m, V v) { return _mm_and_pd(m, v); }
  static V PowerOfTwo(V n) {
    const V e = _mm_add_pd(_mm_sub_pd(Set(1023), n), Set(4503599627370496.0));
    return _mm_castsi128_pd(_mm_slli_epi64(_mm_castpd_si128(e), 52));
  }

  static uint64_t TileMask(float x, float y, const MaskQuery& query) {
    const TileRows rows = RowsFrom(y, query);
    const __m128 c = _mm_set1_ps(query.cos);
    uint64_t mask = 0;
    for (int half = 0; half < 2; ++half) {
      const __m128 at =
          _mm_add_ps(_mm_set1_ps(x + 4 * static_cast<float>(half)), _mm_setr_ps(0, 1, 2, 3));
      const __m128 along = _mm_mul_ps(at, c);
      const __m128 square = _mm_mul_ps(at, at);
      for (int row = 0; row < 8; ++row) {
        const __m128 ahead = _mm_cmpge_ps(along, _mm_set1_ps(rows.ahead[row]));
        const __m128 near = _mm_cmple_ps(square, _mm_set1_ps(rows.rest[row]));
        const auto bits = static_cast<uint64_t>(_mm_movemask_ps(_mm_and_ps(ahead, near)));
        mask |= bits << (8 * row + 4 * half);
      }
    }
    return mask;
  }
};

}  // namespace

const Kernel kSse2Kernel = {"sse2", WeighFor<Sse2>, MaskFor<Sse2>};

}  // namespace pheromone::field
