// pheromonectl journal check, dump, export: a journal's folder looked at, without a server or
// beside it. Nothing is changed.
//
// Each prints to standard output, or what is wrong to standard error, and returns the exit status:
// 0; 1 if the folder cannot be read; 4 if something in it is damaged.
#pragma once

#include <string>

#include "server/base/result.h"

namespace pheromone::ctl {

constexpr int kFoundDamage = 4;

/// Whether a folder is there and holds a journal. Errors say what it is instead.
Status HoldsJournal(const std::string& folder);

/// Reads every byte of every file, then makes the state of it, as a start of the server would.
int CheckJournal(const std::string& folder);

/// Every record of every segment, with its place, in words.
int DumpJournal(const std::string& folder);

/// The events, each once, as "csv" or "jsonl".
int ExportJournal(const std::string& folder, const std::string& format);

}  // namespace pheromone::ctl
