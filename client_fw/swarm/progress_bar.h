// A bar on the terminal, for commands in virtual time.
#pragma once

#include <cstdint>
#include <functional>

namespace pheromone::swarm {

/// A bar of 40 places, renewed when the percentage changes; empty if standard error is no terminal.
std::function<void(int64_t ms)> ProgressBar(int64_t duration_ms);

/// Clears it.
void EndProgressBar(const std::function<void(int64_t ms)>& bar);

}  // namespace pheromone::swarm
