// pheromone-experiments laws: the steering laws side by side, and the search that tunes them.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`.
void AddLawsCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
