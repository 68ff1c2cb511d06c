// pheromone-swarm lab: swarms of thousands on the server's own field, with an ideal or a modelled
// radio, or with each byte on the air (client_fw/lab).
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`.
void AddLabCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
