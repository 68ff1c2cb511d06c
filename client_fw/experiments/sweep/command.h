// pheromone-experiments sweep: path following against one parameter at a time.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`.
void AddSweepCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
