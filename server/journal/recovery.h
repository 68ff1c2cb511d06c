// From the files of a journal to the engine that they describe: the newest snapshot that is whole,
// and the records after it. Nothing is changed.
//
//   Result<Recovered> recovered = Recover(folder);
//   if (recovered.ok()) service = Service(log, clock, start_ms,
//   std::move(recovered.value().engine));
//
// What comes out is the state after a prefix of the events in the order in which they were
// submitted. It contains every acknowledged change, unless acknowledged bytes were damaged; then it
// ends before the first damaged one, and `lost` says so.
//
// How a damaged tail is told from one that was merely not finished when the power went: every group
// of records begins with the sequence up to which all was durable by then. Where a record is bad
// and a later one says that its sequence was durable, bytes that were on the disk have been
// damaged. Where none says so, it is the end of a log that was being written, and nobody was told
// of what stood there (nor in a `relaxed` journal of more than its risk). Where segments look
// complete, but end before what the file `durable` says was on the disk, something is missing too:
// a whole segment, or an end that was cut off between two records. What was acknowledged after the
// last note, about a second, and cut off so, cannot be missed by anybody.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/engine/engine.h"
#include "server/journal/durable_note.h"
#include "server/journal/folder.h"

namespace pheromone::journal {

/// Something that is not as it should be, or was not finished.
struct Finding {
  std::string file;
  uint64_t byte = 0;
  std::string what;
  bool is_damage = false;  ///< else only the end of something unfinished

  /// "FILE: byte N: what".
  std::string Text() const;
};

struct Recovered {
  engine::Engine engine;  ///< not configured: there was nothing
  uint64_t sequence = 0;  ///< of the last event in it
  engine::Stamp stamp;    ///< and when that was

  /// All up to here is known to be on the disk. The events after it were read back, but perhaps
  /// only from the system's memory, where a sync that failed may have left them: `tail` has their
  /// records, to be written again.
  uint64_t certain = 0;
  std::string tail;

  bool lost = false;     ///< acknowledged changes are missing, or may be
  bool differs = false;  ///< the state has not the hash that was noted when it was made
  std::vector<Finding> findings;

  /// What the file `durable` says, if it is there and whole.
  std::optional<DurableNote> noted;

  uint64_t next_ordinal = 1;          ///< for the next segment
  uint64_t snapshot_sequence = 0;     ///< where it was begun from; 0: from nothing
  uint64_t bytes_since_snapshot = 0;  ///< of segments
  bool ends_orderly = false;          ///< a server closed it, and nothing follows
  bool ends_with_hash = false;        ///< and it is the state's
  /// Damaged snapshots, and segments from the first damaged one on: not to be read again.
  std::vector<std::string> damaged_files;
};

/// How far a recovery has come.
struct Progress {
  uint64_t bytes_done = 0;
  uint64_t bytes_total = 0;  ///< of all files that may have to be read
  uint64_t events = 0;       ///< applied
};
using TellProgress = std::function<void(const Progress&)>;

/// Reads segments with ordinals below `before_ordinal`. `tell` is called after each event and each
/// piece of a file: often. A file of any size takes a bounded amount of memory. Errors: a file
/// cannot be read, is of another version, or the beginning is missing, so that no state can be
/// told.
Result<Recovered> Recover(const Folder& folder, uint64_t before_ordinal = UINT64_MAX,
                          const TellProgress& tell = {});

}  // namespace pheromone::journal
