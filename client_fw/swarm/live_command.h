// pheromone-swarm live: one robot against a running pheromoned, in real time.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`.
void AddLiveCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
