// Behaviours from a shared library that is compiled elsewhere, against behaviour_abi.h alone.
//
//   auto behaviour = LoadPlugin("./flee.so", {{"speed", 0.2}});
//   if (!behaviour.ok()) ...   // no such file, no behaviour in it, or one of another version
//
// The library stays loaded as long as the behaviour lives. It runs in this process: a plug-in that
// writes where it should not can do anything.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/lab/behaviour.h"

namespace pheromone::lab {

using PluginParameters = std::vector<std::pair<std::string, double>>;

/// `path` has a slash in it: libraries are not searched for.
Result<std::shared_ptr<Behaviour>> LoadPlugin(const std::string& path,
                                              const PluginParameters& parameters);

}  // namespace pheromone::lab
