// pheromone-experiments bridge: the double bridge experiment, in virtual time.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`.
void AddBridgeCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
