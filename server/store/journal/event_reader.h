// Reads all events in the segments of a journal, in order and each once, without building a state:
// for inspection and export. Events before the oldest segment exist only in snapshots.
//
//   Result<Walked> walked = WalkEvents(folder, [](const Record& record) { ... });
//
// Can be used on a folder that a server is writing to.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/base/result.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/format.h"

namespace pheromone::journal {

struct Walked {
  uint64_t first = 0;  ///< sequence; 0: there was none
  uint64_t last = 0;
  uint64_t events = 0;
  /// Where and why reading stopped before the end of the last segment; empty if it did not.
  std::string cut_short;
};

/// `visit` is called with each event record; the data it points to is valid during the call.
Result<Walked> WalkEvents(const Folder& folder, const std::function<void(const Record&)>& visit);

}  // namespace pheromone::journal
