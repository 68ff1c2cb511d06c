// Numbers that no other process has: IDs, seeds, keys. What has to be repeatable is given its seed.
#pragma once

#include <sys/random.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <span>

namespace pheromone {

inline uint64_t Random64() {
  std::random_device random;
  return uint64_t{random()} << 32 | random();
}

/// Fills with bytes that nobody can predict, from the kernel. Soon after the machine has started it
/// may wait for them. There is nothing to go on with if the kernel has none: the program ends.
inline void FillRandom(std::span<uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = getrandom(bytes.data(), bytes.size(), 0);
    if (count < 0 && errno != EINTR) {
      std::abort();
    }
    bytes = bytes.subspan(count < 0 ? 0 : static_cast<size_t>(count));
  }
}

}  // namespace pheromone
