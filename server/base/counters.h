// Arithmetic on structs that consist of uint64_t counters and of other such structs, and nothing
// else. No list of their members is needed, so none can be forgotten.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace pheromone {

/// `combine(a's counter, b's counter)` for each.
template <typename Counters, typename Combine>
constexpr Counters CombineCounters(const Counters& a, const Counters& b, Combine&& combine) {
  static_assert(std::is_trivially_copyable_v<Counters> &&
                sizeof(Counters) % sizeof(uint64_t) == 0 && alignof(Counters) == alignof(uint64_t));
  using Words = std::array<uint64_t, sizeof(Counters) / sizeof(uint64_t)>;
  Words words = std::bit_cast<Words>(a);
  const Words others = std::bit_cast<Words>(b);
  for (size_t i = 0; i < words.size(); ++i) {
    words[i] = combine(words[i], others[i]);
  }
  return std::bit_cast<Counters>(words);
}

template <typename Counters>
constexpr Counters SumOf(const Counters& a, const Counters& b) {
  return CombineCounters(a, b, [](uint64_t x, uint64_t y) { return x + y; });
}

template <typename Counters>
constexpr Counters DifferenceOf(const Counters& a, const Counters& b) {
  return CombineCounters(a, b, [](uint64_t x, uint64_t y) { return x - y; });
}

}  // namespace pheromone
