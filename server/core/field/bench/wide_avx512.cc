// Sixteen nodes at a time.

#include <immintrin.h>

#include "server/core/field/bench/wide_lanes.h"

namespace pheromone::field::bench {
namespace {

struct Avx512 {
  static constexpr int kWidth = 16;
  using V = __m512;
  using W = __m512i;
  using M = __mmask16;
  static V Set(float v) { return _mm512_set1_ps(v); }
  static V Count() { return _mm512_set_ps(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0); }
  static W Load(const uint32_t* p) { return _mm512_loadu_si512(p); }
  static V Add(V a, V b) { return _mm512_add_ps(a, b); }
  static V Sub(V a, V b) { return _mm512_sub_ps(a, b); }
  static V Min(V a, V b) { return _mm512_min_ps(a, b); }
  static V MulAdd(V a, V b, V c) { return _mm512_fmadd_ps(a, b, c); }
  static V NegMulAdd(V a, V b, V c) { return _mm512_fnmadd_ps(a, b, c); }
  static V Sqrt(V v) { return _mm512_sqrt_ps(v); }
  static V Clamp01(V v) { return _mm512_min_ps(_mm512_max_ps(v, Set(0)), Set(1)); }
  static M NotNegative(V v) { return _mm512_cmp_ps_mask(v, Set(0), _CMP_GE_OQ); }
  static M AtMost(V a, V b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
  static M And(M a, M b) { return static_cast<M>(a & b); }
  static bool None(M m) { return m == 0; }
  static V Keep(M m, V v) { return _mm512_maskz_mov_ps(m, v); }
  static V Level(W word, uint32_t now_ticks) {
    const W since =
        _mm512_and_si512(_mm512_sub_epi32(_mm512_set1_epi32(static_cast<int>(now_ticks)), word),
                         _mm512_set1_epi32(static_cast<int>(kTickMask)));
    const W left = _mm512_sub_epi32(_mm512_srli_epi32(word, kTickBits),
                                    _mm512_srli_epi32(since, kTicksPerTauBits));
    return _mm512_cvtepi32_ps(_mm512_max_epi32(left, _mm512_setzero_si512()));
  }
  static void Store(float* p, V v) { _mm512_storeu_ps(p, v); }
  static void Use(W word) { asm volatile("" : : "v"(word)); }
};

}  // namespace

const Wide kAvx512Wide = WideOf<Avx512>("AVX-512");

}  // namespace pheromone::field::bench
