// pheromone-swarm pioneer: a simulated Pioneer in real time, for any ARCOS client.
//
//   pheromone-swarm pioneer --model p3dx-sh --pty pioneer.pty
//   pheromone-swarm pioneer --tcp 8101 --drift 2 --slip 5 --seed 7
//
// Runs until SIGTERM or SIGINT, and removes the pty's link then. Handles the two signals while it
// runs. One thread.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`,
/// which must outlive `app`: 0 ended by a signal, kFailed the port could not be opened.
void AddPioneerCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
