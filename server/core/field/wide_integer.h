// Whole numbers beyond 64 bits, for what is decided exactly. Internal to server/core.
//
// Lengths up to 2^51 um make products of two in 102 bits, and products of those in 204.
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>

namespace pheromone::field {

__extension__ using Int128 = __int128;
__extension__ using UInt128 = unsigned __int128;

struct UInt256 {
  UInt128 high;
  UInt128 low;
  auto operator<=>(const UInt256&) const = default;
};

inline UInt256 Multiply(UInt128 a, UInt128 b) {
  constexpr UInt128 kLow = ~uint64_t{0};
  const UInt128 low = (a & kLow) * (b & kLow);
  const UInt128 cross = (a >> 64) * (b & kLow) + (low >> 64);
  const UInt128 middle = (a & kLow) * (b >> 64) + (cross & kLow);
  return {(a >> 64) * (b >> 64) + (cross >> 64) + (middle >> 64), (middle << 64) | (low & kLow)};
}

/// Whether |a| is below, equal to or above the root of `b` times `c`, both >= 0.
inline auto CompareToRoot(Int128 a, Int128 b, Int128 c) {
  const auto magnitude = static_cast<UInt128>(a < 0 ? -a : a);
  return Multiply(magnitude, magnitude) <=>
         Multiply(static_cast<UInt128>(b), static_cast<UInt128>(c));
}

/// The root of `square`, 0 to 2^102, rounded down. The estimate is off by one at most.
inline int64_t FloorRoot(Int128 square) {
  auto root = static_cast<int64_t>(std::sqrt(static_cast<double>(square)));
  while (Int128{root} * root > square) {
    --root;
  }
  while (Int128{root + 1} * (root + 1) <= square) {
    ++root;
  }
  return root;
}

/// The root of `a` times `b`, a product up to 2^204, rounded down.
inline Int128 FloorRoot(Int128 a, Int128 b) {
  Int128 root = 0;
  for (Int128 bit = Int128{1} << 102; bit > 0; bit >>= 1) {
    if (CompareToRoot(root + bit, a, b) <= 0) {
      root += bit;
    }
  }
  return root;
}

}  // namespace pheromone::field
