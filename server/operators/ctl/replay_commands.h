// pheromonectl replay: replays recordings, either in this program's own engine, comparing every
// answer, or by sending the requests to a running server at the recorded pace.
//
// Each prints what it did to standard output, or errors to standard error, and returns the exit
// status: 0; 1 for a difference, or a file that cannot be replayed to its end; 2 for an error in
// the command line, or a file that cannot be opened.
#pragma once

#include <string>
#include <vector>

namespace pheromone::ctl {

/// Replays files, one after the other. With `answers`, each message that the engine produces is
/// printed: field time in ms, link, frame.
int ReplayFiles(const std::vector<std::string>& files, bool answers);

struct PlayOptions {
  std::string to;      ///< a terminal's path, or HOST:PORT
  std::string link;    ///< only traffic of this one; empty: all
  double speed = 1.0;  ///< times the recorded pace; 0: without pauses
};

/// Sends the requests of a file's robots. Each recorded connection becomes one to HOST:PORT; to a
/// terminal, all requests are sent in sequence. Answers are counted, but not compared.
int PlayFile(const std::string& file, const PlayOptions& options);

}  // namespace pheromone::ctl
