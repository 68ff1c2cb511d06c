// What operators changed and what was refused to whom, in the log and beside the journal, where it
// outlives the server: a line of JSON for each in audit.jsonl.
//
//   Audit audit(&control, journal.folder());    // empty: only the log
//
//   {"time":"2026-11-26T21:50:01.123Z","who":"web 192.0.2.7","what":"undid: paint","done":true}
//
// At kMaxBytes the file becomes audit.1.jsonl, in place of the one before. A disk that is full or
// stuck holds up nothing but this: what could not be written is told in the log.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "server/daemon/work_queue.h"
#include "server/operators/control/control.h"

namespace pheromone::daemon {

class Audit {
 public:
  static constexpr uint64_t kMaxBytes = uint64_t{8} << 20;

  /// `control` outlives it.
  Audit(control::Control* control, std::string folder, uint64_t max_bytes = kMaxBytes);
  Audit(const Audit&) = delete;
  Audit& operator=(const Audit&) = delete;
  /// Writes what has come.
  ~Audit();

 private:
  void Take();
  void Keep();
  std::string WriteLines(const std::string& lines) const;

  const std::string folder_;
  const uint64_t max_bytes_;
  std::mutex mutex_;
  std::string lines_;    // under mutex_: not written yet
  std::string trouble_;  // that was told
  WorkQueue log_;
  WorkQueue file_;
  std::unique_ptr<control::Subscription> subscription_;
};

}  // namespace pheromone::daemon
