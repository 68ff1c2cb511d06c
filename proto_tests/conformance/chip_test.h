// What the tests on a chip have in common: the chip, and random inputs.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>

#include "proto_tests/conformance/client.h"
#include "protocol/testing/listen.h"

namespace pheromone::conformance {

// Each test powers up its own processor.
class ChipTest : public ::testing::Test {
 protected:
  ConformanceClient chip_;
};

// Random inputs, the same on every machine.
class Dice {
 public:
  explicit Dice(uint64_t seed) : generator_(seed) {}

  size_t Below(size_t limit) { return static_cast<size_t>(generator_() % limit); }
  bool OneIn(size_t limit) { return Below(limit) == 0; }

  /// Any integer of a type; every other time one near 0 or the type's ends.
  template <typename Integer>
  Integer Any() {
    constexpr int64_t kEnds[] = {0, std::numeric_limits<Integer>::min(),
                                 std::numeric_limits<Integer>::max()};
    if (OneIn(2)) {
      const int64_t near = kEnds[Below(3)] + static_cast<int64_t>(Below(5)) - 2;
      return static_cast<Integer>(near);  // wraps around the ends
    }
    return static_cast<Integer>(generator_());
  }

  /// -bound to bound, over all magnitudes.
  int32_t Within(int32_t bound) {
    const size_t size = 2 * static_cast<size_t>(bound >> Below(24)) + 1;
    return static_cast<int32_t>(Below(size)) - static_cast<int32_t>(size / 2);
  }

  /// The bytes that mean something come much more often than the others.
  testing::Bytes Some(size_t size) {
    constexpr uint8_t kLoaded[] = {0x10, 0x10, 0x10, 0x02, 0x03, 0x00};
    testing::Bytes bytes(size);
    for (uint8_t& byte : bytes) {
      const size_t roll = Below(16);
      byte = roll < sizeof(kLoaded) ? kLoaded[roll] : static_cast<uint8_t>(Below(256));
    }
    return bytes;
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace pheromone::conformance
