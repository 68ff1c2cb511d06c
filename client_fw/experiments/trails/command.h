// pheromone-experiments trails: the two-trail bench, driven or by timetable, in virtual or real
// time.
#pragma once

#include <CLI/CLI.hpp>

namespace pheromone::swarm {

/// Adds the command; when it is given, it runs in parse(), and its exit status goes to `status`.
void AddTrailsCommand(CLI::App* app, int* status);

}  // namespace pheromone::swarm
