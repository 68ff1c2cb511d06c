// The portable kernel: one node at a time, for any processor.

#include "server/field/kernel_lanes.h"
#include "server/field/kernel_table.h"

namespace pheromone::field {
namespace {

union Bits {
  uint64_t word;
  double number;
};

struct Scalar {
  static constexpr int kWidth = 1;
  using V = double;
  using W = uint64_t;
  using M = bool;
  static V Set(double v) { return v; }
  static V Load(const double* p) { return *p; }
  static W LoadWords(const uint64_t* const* p) { return __atomic_load_n(*p, __ATOMIC_RELAXED); }
  static V TimeOf(W w) { return static_cast<double>(w & kTimeMask); }
  static V LevelOf(W w) { return static_cast<double>(w >> kTimeBits); }
  static void Store(double* p, V v) { *p = v; }
  static V Add(V a, V b) { return a + b; }
  static V Sub(V a, V b) { return a - b; }
  static V Mul(V a, V b) { return a * b; }
  static V Div(V a, V b) { return a / b; }
  static V Sqrt(V v) { return __builtin_sqrt(v); }
  static V Min(V a, V b) { return a < b ? a : b; }
  static V Max(V a, V b) { return a > b ? a : b; }
  static V Truncate(V v) { return static_cast<double>(static_cast<int32_t>(v)); }
  static M AtLeast(V a, V b) { return a >= b; }
  static V Keep(M m, V v) { return m ? v : 0; }
  static V PowerOfTwo(V n) {
    Bits bits{};
    bits.word = static_cast<uint64_t>(1023 - static_cast<int>(n)) << 52;
    return bits.number;
  }

  static uint64_t TileMask(float left, float y, const MaskQuery& query) {
    const TileRows rows = RowsFrom(y, query);
    uint64_t mask = 0;
    for (int row = 0; row < 8; ++row) {
      for (int i = 0; i < 8; ++i) {
        const float x = left + static_cast<float>(i);
        const bool seen = x * query.cos >= rows.ahead[row] && x * x <= rows.rest[row];
        mask |= static_cast<uint64_t>(seen) << (8 * row + i);
      }
    }
    return mask;
  }
};

}  // namespace

const Kernel kScalarKernel = {"scalar", WeighFor<Scalar>, MaskFor<Scalar>};

double Exp2Minus(double x) {
  return Exp2Minus<Scalar>(x);
}

}  // namespace pheromone::field
