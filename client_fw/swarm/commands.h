// The commands of pheromone-swarm: what each does is said in NAME_command.cc.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Each adds its command; when it is given, it runs in parse(), and its exit status goes to
/// `status`, which must outlive `app`.
void AddLabCommand(CLI::App* app, int* status);
void AddLiveCommand(CLI::App* app, int* status);
void AddPathCommand(CLI::App* app, int* status);
void AddPioneerCommand(CLI::App* app, int* status);
void AddRunCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
