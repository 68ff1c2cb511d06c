// Opens the folder of a journal: recovers its state and continues the journal from there.
//
//   Result<Opened> opened = OpenJournal(folder.get(), settings, clock, tell);
//   if (!opened.ok()) ...                      // no file was changed
//   for (const std::string& line : opened.value().report) log(line);
//
// Damaged files are renamed to end in ".damaged" and never removed; before that, the recovered
// state is written to a new snapshot.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/core/engine/engine.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/local_journal.h"
#include "server/store/journal/recovery.h"

namespace pheromone::journal {

struct Opened {
  engine::Engine engine;  ///< not configured: the journal is new
  engine::Stamp stamp;    ///< of the last event
  /// Acknowledged changes are or may be missing: the state begins a new epoch, unless the log of a
  /// cluster has them.
  bool state_lost = false;
  std::unique_ptr<LocalJournal> journal;  ///< with its first segment begun, if possible
  std::vector<std::string> report;        ///< the findings as text, damage first
};

/// `folder` outlives the journal. Errors: no state can be recovered from the files, or damaged
/// files cannot be renamed.
Result<Opened> OpenJournal(Folder* folder, const JournalSettings& settings,
                           LocalJournal::ReadMicroseconds clock, LocalJournal::Tell tell,
                           const TellProgress& tell_progress = {});

}  // namespace pheromone::journal
