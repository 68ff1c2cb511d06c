// pheromonectl config check: what pheromoned --check says, without a server.
#pragma once

#include <string>

namespace pheromone::ctl {

/// Prints what the file means, in words, or on standard error what is wrong with it. Returns the
/// exit status: 0, or 2 for mistakes.
int CheckConfig(const std::string& path);

}  // namespace pheromone::ctl
