// The folders that a running server writes to, its journal's and that of its recordings: where they
// are, and whether they could be used. Nothing is written or made: a server may be using them.
//
//   const FolderReport report = LookAtFolders(config, std::getenv("STATE_DIRECTORY"));
//   for (const std::string& warning : report.warnings) { std::cerr << warning << '\n'; }
//
// `state_directory` is what systemd sets in $STATE_DIRECTORY: a folder, or several separated by
// colons, of which the first counts; null or empty: there is none.
#pragma once

#include <string>
#include <vector>

#include "server/config/config.h"

namespace pheromone::config {

/// As configured, else `journal` in the state directory; empty: the state is not kept.
std::string JournalFolder(const JournalConfig& config, const char* state_directory);

/// Where recordings go. A relative one begins at the state directory, or else at the working
/// directory.
std::string CaptureFolder(const CaptureSettings& config, const char* state_directory);

struct FolderReport {
  std::vector<std::string> lines;     ///< where each is, in words
  std::vector<std::string> warnings;  ///< why one cannot be used by the user who asks
};

FolderReport LookAtFolders(const Config& config, const char* state_directory);

}  // namespace pheromone::config
