// The commands of pheromone-experiments: what each does is said in NAME/command.cc.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Each adds its command; when it is given, it runs in parse(), and its exit status goes to
/// `status`, which must outlive `app`.
void AddBridgeCommand(CLI::App* app, int* status);
void AddChannelCommand(CLI::App* app, int* status);
void AddCleaningCommand(CLI::App* app, int* status);
void AddDetourCommand(CLI::App* app, int* status);
void AddLawsCommand(CLI::App* app, int* status);
void AddSweepCommand(CLI::App* app, int* status);
void AddTrailsCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
