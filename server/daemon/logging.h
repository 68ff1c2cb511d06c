// The daemon's log: standard error, with time and colour on a terminal; without them under systemd,
// whose journal adds the time.
//
//   SetUpLogging("info");
//   spdlog::info("...");             // any thread; never waits
//   return EndLogging(Run());
//
// A thread of its own writes: a terminal that is held, a pager that nobody scrolls or a journal
// that waits for its disk must not hold up a robot. While it cannot write, the log keeps its last
// lines, and tells afterwards how many are missing.
#pragma once

#include <string>

namespace pheromone::daemon {

/// Sets up the default logger, once. `level` is one of the words of the configuration's
/// daemon.log_level.
void SetUpLogging(const std::string& level);

/// Writes what is left, and returns `status`. If it cannot be written within 2 s, the process ends
/// here, with this status.
int EndLogging(int status);

}  // namespace pheromone::daemon
