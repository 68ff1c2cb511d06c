// What the daemon logs of its statistics when it stops, and of keys that change. Lines without line
// ends.
#pragma once

#include <string>
#include <vector>

#include "server/core/engine/service/service.h"
#include "server/robots/links/link.h"
#include "server/robots/signing/keys.h"

namespace pheromone::daemon {

/// Requests, answers and errors by reason, over all links.
std::vector<std::string> DescribeCounters(const engine::ServiceCounters& counters);

/// Errors concerning robots, with their counts; empty if there were none.
std::string DescribeTrouble(const engine::RobotCounters& counters);

/// The frames and bytes of a link, and all kinds of losses that occurred.
std::string DescribeLink(const std::string& name, const links::LinkCounters& counters);

/// The robots whose keys differ: "revoked 3, added 7 8".
std::string DescribeKeys(const signing::Keys& before, const signing::Keys& after);

}  // namespace pheromone::daemon
