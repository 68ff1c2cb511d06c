// Reads all events in the segments of a journal, in order and each once, without building a state:
// for inspection and export. Events of segments that were removed exist only in snapshots, and are
// left out. Reading stops where events are missing.
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
  /// Events that were durable are missing there, or later segments are not read; else, it stopped
  /// at the unfinished end of the log, as a running server has it, or one that was killed.
  bool is_damaged = false;
};

/// `visit` is called with each event record; the data it points to is valid during the call.
/// Errors: a file cannot be read, or is of another version.
Result<Walked> WalkEvents(const Folder& folder, const std::function<void(const Record&)>& visit);

}  // namespace pheromone::journal
