// pheromonectl config check: the same as pheromoned --check.
#pragma once

#include <string>

namespace pheromone::ctl {

/// Prints a summary of the file, or its errors on standard error. Returns the exit status: 0, or 2
/// for errors.
int CheckConfig(const std::string& path);

}  // namespace pheromone::ctl
