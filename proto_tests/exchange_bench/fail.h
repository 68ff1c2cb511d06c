// What exchange_bench says when it cannot go on.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace pheromone::bench {

/// Prints the reason on standard error, and ends this process.
[[noreturn]] inline void Fail(const std::string& why) {
  fmt::print(stderr, "exchange_bench: {}\n", why);
  std::exit(1);
}

}  // namespace pheromone::bench
