// Eight nodes at a time.

#include <immintrin.h>

#include "server/core/field/bench/wide_lanes.h"

namespace pheromone::field::bench {
namespace {

struct Avx2 {
  static constexpr int kWidth = 8;
  using V = __m256;
  using W = __m256i;
  using M = __m256;
  static V Set(float v) { return _mm256_set1_ps(v); }
  static V Count() { return _mm256_set_ps(7, 6, 5, 4, 3, 2, 1, 0); }
  static W Load(const uint32_t* p) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
  }
  static V Add(V a, V b) { return _mm256_add_ps(a, b); }
  static V Sub(V a, V b) { return _mm256_sub_ps(a, b); }
  static V Min(V a, V b) { return _mm256_min_ps(a, b); }
  static V MulAdd(V a, V b, V c) { return _mm256_fmadd_ps(a, b, c); }
  static V NegMulAdd(V a, V b, V c) { return _mm256_fnmadd_ps(a, b, c); }
  static V Sqrt(V v) { return _mm256_sqrt_ps(v); }
  static V Clamp01(V v) { return _mm256_min_ps(_mm256_max_ps(v, Set(0)), Set(1)); }
  static M NotNegative(V v) { return _mm256_cmp_ps(v, Set(0), _CMP_GE_OQ); }
  static M AtMost(V a, V b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
  static M And(M a, M b) { return _mm256_and_ps(a, b); }
  static bool None(M m) { return _mm256_movemask_ps(m) == 0; }
  static V Keep(M m, V v) { return _mm256_and_ps(m, v); }
  static V Level(W word, uint32_t now_ticks) {
    const W since =
        _mm256_and_si256(_mm256_sub_epi32(_mm256_set1_epi32(static_cast<int>(now_ticks)), word),
                         _mm256_set1_epi32(static_cast<int>(kTickMask)));
    const W left = _mm256_sub_epi32(_mm256_srli_epi32(word, kTickBits),
                                    _mm256_srli_epi32(since, kTicksPerTauBits));
    return _mm256_cvtepi32_ps(_mm256_max_epi32(left, _mm256_setzero_si256()));
  }
  static void Store(float* p, V v) { _mm256_storeu_ps(p, v); }
  static void Use(W word) { asm volatile("" : : "x"(word)); }
};

}  // namespace

const Wide kAvx2Wide = WideOf<Avx2>("AVX2");

}  // namespace pheromone::field::bench
