// A configuration in words, for the log, for --check and for the operator. Lines without their end.
#pragma once

#include <string>
#include <vector>

#include "server/config/config.h"

namespace pheromone::config {

/// The map, each pheromone's law in words, and what lies on the map.
std::vector<std::string> DescribeConfig(const Config& config);

/// Links, trackers, control socket, web and cluster. `runtime_directory` is $RUNTIME_DIRECTORY
/// (folders.h).
std::vector<std::string> DescribeReach(const Config& config, const char* runtime_directory);

/// What `pheromoned --check` and `pheromonectl config check` say of a configuration that could be
/// read: `name`, that it is good, and what it means, to standard output; warnings and errors to
/// standard error. With errors there is no text. `state_directory` is $STATE_DIRECTORY (folders.h).
struct CheckReport {
  std::string text;
  std::string warnings;
  std::string errors;
};
CheckReport DescribeCheck(const std::string& name, const Config& config,
                          const char* state_directory);

}  // namespace pheromone::config
