// pheromone-experiments cleaning: robots that clean a grid of zones, in virtual time.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`.
void AddCleaningCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
