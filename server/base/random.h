// Numbers that no other process has: IDs, seeds. What has to be repeatable is given its seed.
#pragma once

#include <cstdint>
#include <random>

namespace pheromone {

inline uint64_t Random64() {
  std::random_device random;
  return uint64_t{random()} << 32 | random();
}

}  // namespace pheromone
