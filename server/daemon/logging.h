// The daemon's log: standard error, with time and colour on a terminal; without them under systemd,
// whose journal adds the time.
#pragma once

#include <string>

namespace pheromone::daemon {

/// Sets up the default logger, once, before there are threads. `level` is one of the words of the
/// configuration's daemon.log_level.
void SetUpLogging(const std::string& level);

}  // namespace pheromone::daemon
