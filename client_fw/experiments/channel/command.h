// pheromone-experiments channel: how many robots a radio channel can serve, in virtual time.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`.
void AddChannelCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
