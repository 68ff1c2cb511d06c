// Recovers an engine from the files of a journal: the newest valid snapshot and the records after
// it. No file is changed.
//
//   Result<Recovered> recovered = Recover(folder);
//   if (!recovered.ok()) ...
//   service = Service(log, clock, start_ms, std::move(recovered.value().engine));
//
// The result is the state after a prefix of the events in the order in which they were submitted.
// It contains every acknowledged change, unless acknowledged bytes were damaged; then it ends
// before the first damaged one, and `lost` is set.
//
// A damaged tail is distinguished from one that was incomplete at a power failure as follows. Every
// group of records begins with the sequence up to which everything was durable at that time. If a
// record is bad and a later one says that its sequence was durable, durable bytes were damaged. If
// none says so, it is the end of a log that was being written, and nothing there was acknowledged
// (in a `relaxed` journal, no more than its configured risk). If segments look complete but end
// before the sequence in the file `durable`, a whole segment, or the end of one, is missing. The
// loss of changes acknowledged after the last mark, about one second, cannot be detected if the log
// is truncated exactly between two records.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/core/engine/engine.h"
#include "server/store/journal/durable_note.h"
#include "server/store/journal/folder.h"

namespace pheromone::journal {

/// Something damaged or incomplete.
struct Finding {
  std::string file;
  uint64_t byte = 0;
  std::string what;
  bool is_damage = false;  ///< otherwise only incomplete

  /// "FILE: byte N: what".
  std::string Text() const;
};

struct Recovered {
  engine::Engine engine;  ///< not configured if the journal is empty
  uint64_t sequence = 0;  ///< of the last event in it
  engine::Stamp stamp;    ///< and when that was

  /// Everything up to here is known to be durable. The events after it were read, but perhaps only
  /// from the page cache, where a failed sync may have left them: `tail` has their records, to be
  /// written again.
  uint64_t certain = 0;
  std::string tail;

  bool lost = false;     ///< acknowledged changes are missing, or may be
  bool differs = false;  ///< state hash mismatch
  std::vector<Finding> findings;

  /// The durability mark, if there is a valid one.
  std::optional<DurableNote> noted;

  uint64_t next_ordinal = 1;          ///< for the next segment
  uint64_t snapshot_sequence = 0;     ///< of the snapshot used; 0: none
  uint64_t bytes_since_snapshot = 0;  ///< of segments
  uint64_t cost_since_snapshot = 0;   ///< of the events that were applied (Engine::cost)
  bool ends_orderly = false;          ///< closed by a server, and nothing follows
  bool ends_with_hash = false;        ///< and ends with the matching state hash
  /// Damaged snapshots, and all segments from the first damaged one on.
  std::vector<std::string> damaged_files;
};

/// The progress of a recovery.
struct Progress {
  uint64_t bytes_done = 0;
  uint64_t bytes_total = 0;  ///< of all files that may have to be read
  uint64_t events = 0;       ///< applied
};
using TellProgress = std::function<void(const Progress&)>;

/// Reads segments with ordinals below `before_ordinal`. `tell` is called often: after each event
/// and each block of a file. Memory is bounded for files of any size. Errors: a file cannot be read
/// or has another version, or the beginning is missing, so that no state can be recovered.
Result<Recovered> Recover(const Folder& folder, uint64_t before_ordinal = UINT64_MAX,
                          const TellProgress& tell = {});

}  // namespace pheromone::journal
