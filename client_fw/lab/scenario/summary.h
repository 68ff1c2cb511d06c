// The rows of results that many runs append to one CSV file.
//
//   const SummaryRow row = SummaryOf(scenario, result, commit);
//   Status appended = AppendRow("runs.csv", row);
//
// A row has everything that the run depends on: the scenario's name, the commit, the seed and all
// values of its file; then its measures and the hash of its last state. The first run writes the
// header.
//
// Many processes may append at once: each holds the file's lock (flock) and writes its row in one
// piece. A row that is there already is not written again, so a run that was killed after it had
// written, and is repeated, is in the file once; half a line without its end is cut off.
#pragma once

#include <string>
#include <string_view>

#include "client_fw/lab/scenario/run.h"
#include "client_fw/lab/scenario/scenario.h"
#include "server/base/result.h"

namespace pheromone::lab {

struct SummaryRow {
  std::string header;  ///< as a line of CSV, without its end
  std::string row;
};
SummaryRow SummaryOf(const LabScenario& scenario, const LabResult& result, std::string_view commit);

/// Errors: the file cannot be written, or has rows with other columns.
Status AppendRow(const std::string& path, const SummaryRow& row);

}  // namespace pheromone::lab
