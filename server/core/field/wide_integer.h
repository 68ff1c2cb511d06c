// Whole numbers beyond 64 bits, for what is decided exactly. Internal to this folder.
//
// Lengths up to 2^51 um make products of two in 102 bits, and products of those in 204.
#pragma once

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

}  // namespace pheromone::field
