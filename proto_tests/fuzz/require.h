// What a fuzzer holds a program to: the process ends where it does not hold.
#pragma once

#include <cstdlib>

namespace pheromone::fuzz {

inline void Require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

}  // namespace pheromone::fuzz
