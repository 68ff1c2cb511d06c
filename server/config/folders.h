// Where a running server has its files: what is to outlive it, that is its journal, its recordings
// and saved fields, and whether it could be written there; and its socket. Nothing is written or
// made: a server may be using it.
//
//   const char* state = std::getenv("STATE_DIRECTORY");
//   const std::string folder = JournalFolder(config.journal, state);
//   const FolderReport report = LookAtFolders(config, state);
//   for (const std::string& warning : report.warnings) { std::cerr << warning << '\n'; }
//
// `state_directory` and `runtime_directory` are what systemd sets in $STATE_DIRECTORY and
// $RUNTIME_DIRECTORY: a folder, or several separated by colons, of which the first counts; null or
// empty: there is none. A service's working directory is its runtime directory, which is emptied
// when it stops; hence what is kept does not begin there.
#pragma once

#include <string>
#include <vector>

#include "server/config/config.h"

namespace pheromone::config {

/// What `path`, as it is seen from the working directory, is from everywhere; without "." and "..".
std::string AbsolutePath(const std::string& path);

/// Where what is kept lies. An absolute path stays what it is; another one begins at the state
/// directory, or else at the working directory. Empty stays empty.
std::string KeptPath(const std::string& path, const char* state_directory);

/// As configured, else `journal` in the state directory; empty: the state is not kept.
std::string JournalFolder(const JournalConfig& config, const char* state_directory);

/// Why a configuration cannot be used without a journal; empty: it can, or `folder` is its.
std::string WhyNoJournal(const Config& config, const std::string& folder);

/// Where recordings go.
std::string CaptureFolder(const CaptureSettings& config, const char* state_directory);

/// The Unix socket, in the runtime directory unless its path is absolute. Not made absolute, since
/// the length of a socket's path is limited; empty: there is none.
std::string ControlSocket(const ControlSettings& config, const char* runtime_directory);

/// Why files cannot be made in `folder`, or it cannot be made, by the user who asks, and what would
/// have to be otherwise; empty: they can.
std::string WhyUnusable(const std::string& folder, const char* state_directory);

/// That what is kept at `path` is gone when the service stops; empty: it is not.
std::string WhyNotKept(const std::string& path, const char* runtime_directory);

struct FolderReport {
  std::vector<std::string> lines;     ///< where each is, in words
  std::vector<std::string> warnings;  ///< why one cannot be used by the user who asks
  std::vector<std::string> errors;    ///< why the server could not start, whoever runs it
};

FolderReport LookAtFolders(const Config& config, const char* state_directory);

}  // namespace pheromone::config
