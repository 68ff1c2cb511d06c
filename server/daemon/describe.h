// What the daemon says about itself in the log when it ends: its counters. Lines without their end.
#pragma once

#include <string>
#include <vector>

#include "server/engine/service.h"
#include "server/links/link.h"

namespace pheromone::daemon {

/// Requests, answers and errors by reason, over all links.
std::vector<std::string> DescribeCounters(const engine::ServiceCounters& counters);

/// What went wrong among the robots, as far as it happened; empty if nothing did.
std::string DescribeTrouble(const engine::EngineCounters& counters);

/// The frames and bytes of a link, and every kind of loss that happened.
std::string DescribeLink(const std::string& name, const links::LinkCounters& counters);

}  // namespace pheromone::daemon
