// pheromonectl export --csv: what happened in recordings, as three tables for data analysis.
//
//   robots.csv    each robot, so many times a second: pose, what it was last answered, its state
//   deposits.csv  each deposit of a robot, and each edit of the map by an operator
//   events.csv    what robots reported, commands, goals, changes of the configuration
//
// The first line names the columns, with units. `time_s` counts from the beginning of the first
// recording; `utc` is the server's clock. A value that is not known is empty.
#pragma once

#include <string>
#include <vector>

namespace pheromone::ctl {

/// In the folder.
constexpr const char* kCsvTables[] = {"robots.csv", "deposits.csv", "events.csv"};

struct CsvOptions {
  std::string folder;   ///< created if it does not exist
  double rate_hz = 10;  ///< rows of each robot in a second
};

/// Returns the exit status; a recording that cannot be replayed to its end is exported up to there,
/// with kFailed. Earlier tables are replaced at the end, and untouched if there was nothing to
/// export.
int ExportCsv(const std::vector<std::string>& captures, const CsvOptions& options);

}  // namespace pheromone::ctl
