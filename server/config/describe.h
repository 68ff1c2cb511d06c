// A configuration in words, for the log, for --check and for the operator. Lines without their end.
#pragma once

#include <string>
#include <vector>

#include "server/config/config.h"

namespace pheromone::config {

/// The map, each pheromone's law in words, and what lies on the map.
std::vector<std::string> DescribeConfig(const Config& config);

}  // namespace pheromone::config
