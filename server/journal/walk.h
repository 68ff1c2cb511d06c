// All events that a journal's segments still hold, in order and each once, without making a state
// of them: for looking at, and for export. Those before the oldest segment are in snapshots alone.
//
//   Result<Walked> walked = WalkEvents(folder, [](const Record& record) { ... });
//
// Works on a folder that a server is writing to.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/base/result.h"
#include "server/journal/folder.h"
#include "server/journal/format.h"

namespace pheromone::journal {

struct Walked {
  uint64_t first = 0;  ///< sequence; 0: there was none
  uint64_t last = 0;
  uint64_t events = 0;
  /// Where and why it ended before the end of the last segment; empty: it did not.
  std::string cut_short;
};

/// `visit` gets each record of an event; what the record points to is valid during the call.
Result<Walked> WalkEvents(const Folder& folder, const std::function<void(const Record&)>& visit);

}  // namespace pheromone::journal
