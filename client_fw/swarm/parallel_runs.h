// Runs that do not depend on each other, on all processors.
#pragma once

#include <cstddef>
#include <functional>

namespace pheromone::swarm {

/// Calls run(0) to run(count - 1), each once, in any order and several at a time; returns when all
/// have. `run` must not throw.
void RunInParallel(size_t count, const std::function<void(size_t)>& run);

}  // namespace pheromone::swarm
