// pheromonectl journal check, dump, export: read a journal's folder, even while a server uses it.
// Nothing is changed.
//
// Each prints to standard output, or errors to standard error, and returns the exit status: 0; 1 if
// the folder cannot be read; 4 if something in it is damaged.
#pragma once

#include <string>

#include "server/base/result.h"
#include "server/store/journal/event_reader.h"

namespace pheromone::ctl {

constexpr int kFoundDamage = 4;

/// Whether a folder exists and contains a journal. Errors say what was found instead.
Status HoldsJournal(const std::string& folder);

/// Reads every byte of every file, then recovers the state, as the server would at start-up.
int CheckJournal(const std::string& path);

/// Of reading the events of a journal: tells on standard error where it stopped early.
int ReportEnd(const journal::Walked& walked);

/// Prints every record of every segment as text, with its position, and what is no record. That is
/// damage if durable events are missing.
int DumpJournal(const std::string& path);

/// Prints the events, each once, as "csv" or "jsonl".
int ExportJournal(const std::string& path, const std::string& format);

}  // namespace pheromone::ctl
