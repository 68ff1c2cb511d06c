#include "server/core/field/heading.h"

#include <array>
#include <cstddef>

#include "server/core/field/wide_integer.h"

namespace pheromone::field {
namespace {

constexpr int kQuarter = 16384;
constexpr int kOneQ14 = 1 << 14;

constexpr int kFraction = 60;
constexpr int64_t kOneQ60 = int64_t{1} << kFraction;
constexpr int64_t kHalfPiQ60 = 1811004864519280710;  // floor(pi / 2 * 2^60)

int64_t MultiplyQ60(int64_t a, int64_t b) {
  return static_cast<int64_t>((static_cast<Int128>(a) * b) >> kFraction);
}

// The Taylor series of sine (first = x, step = 2, 3) or cosine (first = 1, step = 1, 2) for
// 0 <= x <= pi / 4. Twenty terms leave an error far below the 2^-29 that the rounding to Q14 could
// notice (heading_test.cc measures the margin).
int64_t Series(int64_t first, int64_t x, int64_t divisor) {
  const int64_t square = MultiplyQ60(x, x);
  int64_t sum = first;
  int64_t term = first;
  for (; term != 0; divisor += 2) {
    term = -MultiplyQ60(term, square) / (divisor * (divisor + 1));
    sum += term;
  }
  return sum;
}

std::array<int16_t, kQuarter + 1> MakeQuarterSine() {
  std::array<int16_t, kQuarter + 1> table{};
  for (int i = 0; i <= kQuarter; ++i) {
    const bool low = i <= kQuarter / 2;
    const int steps = low ? i : kQuarter - i;
    const auto x = static_cast<int64_t>(static_cast<Int128>(kHalfPiQ60) * steps / kQuarter);
    const int64_t sine = low ? Series(x, x, 2) : Series(kOneQ60, x, 1);
    const int64_t half = int64_t{1} << (kFraction - 15);
    table[static_cast<size_t>(i)] = static_cast<int16_t>((sine + half) >> (kFraction - 14));
  }
  return table;
}

const std::array<int16_t, kQuarter + 1> kQuarterSine = MakeQuarterSine();

// Without a branch: headings come in no order.
int32_t SineQ14(uint16_t heading) {
  const int quarter = heading / kQuarter;
  const int within = heading % kQuarter;
  const int step = (quarter & 1) != 0 ? kQuarter - within : within;
  const int32_t sine = kQuarterSine[static_cast<size_t>(step)];
  return (quarter & 2) != 0 ? -sine : sine;
}

}  // namespace

DirectionQ14 DirectionOf(uint16_t heading) {
  static_assert(kOneQ14 == 16384);
  return {SineQ14(static_cast<uint16_t>(heading + kQuarter)), SineQ14(heading)};
}

}  // namespace pheromone::field
