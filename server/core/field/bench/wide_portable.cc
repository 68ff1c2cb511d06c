// One node at a time, for processors that the others do not know.

#include <math.h>

#include "server/core/field/bench/wide_lanes.h"

namespace pheromone::field::bench {
namespace {

struct Single {
  static constexpr int kWidth = 1;
  using V = float;
  using W = uint32_t;
  using M = bool;
  static V Set(float v) { return v; }
  static V Count() { return 0; }
  static W Load(const uint32_t* p) { return *p; }
  static V Add(V a, V b) { return a + b; }
  static V Sub(V a, V b) { return a - b; }
  static V Min(V a, V b) { return a < b ? a : b; }
  static V MulAdd(V a, V b, V c) { return a * b + c; }
  static V NegMulAdd(V a, V b, V c) { return c - a * b; }
  static V Sqrt(V v) { return sqrtf(v); }
  static V Clamp01(V v) { return v < 0 ? 0 : Min(v, 1); }
  static M NotNegative(V v) { return v >= 0; }
  static M AtMost(V a, V b) { return a <= b; }
  static M And(M a, M b) { return a && b; }
  static bool None(M m) { return !m; }
  static V Keep(M m, V v) { return m ? v : 0; }
  static V Level(W word, uint32_t now_ticks) {
    const uint32_t count = word >> kTickBits;
    const uint32_t gone = ((now_ticks - word) & kTickMask) >> kTicksPerTauBits;
    return count > gone ? static_cast<float>(count - gone) : 0;
  }
  static void Store(float* p, V v) { *p = v; }
  static void Use(W word) { asm volatile("" : : "r"(word)); }
};

}  // namespace

const Wide kPortableWide = WideOf<Single>("portable");

}  // namespace pheromone::field::bench
