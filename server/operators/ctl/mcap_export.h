// Recordings for viewers: replays captures in an engine and writes what a viewer of the running
// server would have been shown, as an MCAP file. The channels are those of the stream
// (server/operators/web/stream/) that follow from the engine's state; or, for ROS 2, those of
// ros2_show.h.
//
//   int status = ExportMcap({"lab.pcapng"}, {.out = "lab.mcap"});
#pragma once

#include <string>
#include <vector>

namespace pheromone::ctl {

struct McapOptions {
  std::string out;
  double grid_hz = 2;  ///< pictures of each pheromone in a second, of those that changed
  bool ros2 = false;   ///< a bag of ROS 2
};

/// Prints what was written; returns the exit status. A capture that cannot be replayed to its end
/// is exported up to there, and reported as a failure. An earlier file is replaced at the end, and
/// untouched if there was nothing to export.
int ExportMcap(const std::vector<std::string>& captures, const McapOptions& options);

}  // namespace pheromone::ctl
