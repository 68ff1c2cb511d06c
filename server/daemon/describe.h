// What the daemon says about itself in the log: a configuration when it starts, counters when it
// ends. Lines without their end.
#pragma once

#include <string>
#include <vector>

#include "server/config/config.h"
#include "server/engine/service.h"
#include "server/links/link.h"

namespace pheromone::daemon {

/// The map, each pheromone's law in words, and what lies on the map.
std::vector<std::string> DescribeConfig(const config::Config& config);

/// Requests, answers and errors by reason, over all links.
std::vector<std::string> DescribeCounters(const engine::ServiceCounters& counters);

/// What went wrong among the robots, as far as it happened; empty if nothing did.
std::string DescribeTrouble(const engine::EngineCounters& counters);

/// The frames and bytes of a link, and every kind of loss that happened.
std::string DescribeLink(const std::string& name, const links::LinkCounters& counters);

}  // namespace pheromone::daemon
