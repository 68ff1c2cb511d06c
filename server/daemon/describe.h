// The statistics that the daemon logs when it stops. Lines without line ends.
#pragma once

#include <string>
#include <vector>

#include "server/core/engine/service/service.h"
#include "server/robots/links/link.h"

namespace pheromone::daemon {

/// Requests, answers and errors by reason, over all links.
std::vector<std::string> DescribeCounters(const engine::ServiceCounters& counters);

/// Errors concerning robots, with their counts; empty if there were none.
std::string DescribeTrouble(const engine::RobotCounters& counters);

/// The frames and bytes of a link, and all kinds of losses that occurred.
std::string DescribeLink(const std::string& name, const links::LinkCounters& counters);

}  // namespace pheromone::daemon
