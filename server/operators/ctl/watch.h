// pheromonectl watch: the map and the robots, live in a terminal.
//
// The picture follows the terminal's size; q, Escape or Ctrl-C ends it and leaves the terminal as
// it was. Four times a second it requests a raster of the displayed size from the server.
#pragma once

#include <string>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

struct WatchOptions {
  std::string pheromone;  ///< number or name; empty: the first that has a raster
  bool once = false;      ///< one picture, and nothing done to the terminal
  int columns = 0;        ///< 0: the terminal's
  int rows = 0;
  std::string colours;  ///< "none", "256", "24bit"; empty: as the terminal can
};

int Watch(const ServerOptions& options, const WatchOptions& watch);

}  // namespace pheromone::ctl
