// A journal's folder, opened: the state that it holds, and the journal that goes on from there.
//
//   Result<Opened> opened = OpenJournal(folder.get(), settings, clock, tell);
//   if (!opened.ok()) ...                      // nothing was changed
//   for (const std::string& line : opened.value().report) log(line);
//
// What is damaged is moved aside under a name that ends in ".damaged", never removed; before that,
// the state that is left is written to a snapshot of its own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/engine/engine.h"
#include "server/journal/folder.h"
#include "server/journal/local_journal.h"
#include "server/journal/recovery.h"

namespace pheromone::journal {

struct Opened {
  engine::Engine engine;  ///< not configured: the journal is new
  engine::Stamp stamp;    ///< of the last event
  /// Changes that clients were told of are missing, or may be: the state begins a new epoch.
  bool state_lost = false;
  std::unique_ptr<LocalJournal> journal;  ///< its first segment is begun, if that was possible
  std::vector<std::string> report;        ///< what was found, in words; damage first
};

/// `folder` outlives the journal. Errors: no state can be told from the files, or what is damaged
/// cannot be moved aside.
Result<Opened> OpenJournal(Folder* folder, const JournalSettings& settings,
                           LocalJournal::ReadMicroseconds clock, LocalJournal::Tell tell,
                           const TellProgress& tell_progress = {});

}  // namespace pheromone::journal
