// pheromonectl replay: what a server recorded, once more. Either in an engine of this program's
// own, which compares every answer; or sent at its own pace to a server that knows nothing of it.
//
// Each prints what it did to standard output, or what is wrong to standard error, and returns the
// exit status: 0; 1 for a difference, or a file that cannot be replayed to its end; 2 for a mistake
// in the command line, or a file that cannot be opened.
#pragma once

#include <string>
#include <vector>

namespace pheromone::ctl {

/// Replays files, one after the other. With `answers`, each message that the engine gives is
/// printed: field time in ms, link, frame.
int ReplayFiles(const std::vector<std::string>& files, bool answers);

struct PlayOptions {
  std::string to;      ///< a terminal's path, or HOST:PORT
  std::string link;    ///< only what was read on this one; empty: on all
  double speed = 1.0;  ///< times the recorded pace; 0: without pauses
};

/// Sends what a file's robots sent. Each recorded connection becomes one to HOST:PORT; to a
/// terminal all goes in turn. What is answered is read, counted, and not compared.
int PlayFile(const std::string& file, const PlayOptions& options);

}  // namespace pheromone::ctl
