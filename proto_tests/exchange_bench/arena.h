// What exchange_bench asks about: a map with more than a million nodes that hold pheromone, and
// requests with the answers that are right for them.
//
//   const Arena arena = MakeArena(folder, links);   // writes folder/bench.toml and what it names
//   message = arena.Sense(client, pose);            // then compare with arena.answers[pose]
//
// The map is 30 m x 30 m, unless more is asked for, with a node every 20 mm, every other of them,
// at random, with one quantum at the most it can hold; the pheromone is sensed up to r = 5 cells.
// Poses are random, on nodes that hold something: what TRACE leaves there changes nothing, so that
// one answer is right for ever. A second pheromone, for robots that roam, has evaporated two
// seconds after it was left.
//
// The right answers come from the engine itself, in this process: what is checked is that each
// request got its own answer, whole and unchanged. That the engine is right is tested elsewhere.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/frame.h"
#include "protocol/messages.h"

namespace pheromone::bench {

/// The links that the configuration asks for, of each kind: "udp-1" and so on, "pty-1" and so on.
struct LinkNumbers {
  int udp = 1;
  int pty = 16;
};

/// Nodes along a side.
struct MapSize {
  int map = 1501;
  int robots = 1501;  ///< of the part where they drive and something lies, in the lower left corner
};

constexpr int kCellMm = 20;

struct Arena {
  std::string config_file;
  std::string config_text;  ///< what is in it
  size_t live_nodes = 0;
  std::vector<protocol::WirePose> poses;
  std::vector<std::array<uint8_t, 4>> answers;  ///< by pose: P_L and P_R as they are sent

  protocol::Message Sense(uint8_t client, size_t pose) const;
  protocol::Message Trace(uint8_t client, size_t pose, uint8_t seq) const;
  /// TRACE of the pheromone that evaporates.
  protocol::Message Roam(uint8_t client, size_t pose, uint8_t seq) const;
  /// Whether `answer` is the answer to what was asked with these arguments.
  bool IsSenseAnswer(const protocol::Message& answer, uint8_t client, size_t pose) const;
  bool IsTraceAnswer(const protocol::Message& answer, uint8_t client, size_t pose,
                     uint8_t seq) const;
  /// But for the intensities, which the time decides.
  static bool IsRoamAnswer(const protocol::Message& answer, uint8_t client, uint8_t seq);
};

/// `extra` is appended to the configuration. Ends the process if it is refused.
Arena MakeArena(const std::string& folder, const LinkNumbers& links, const std::string& extra,
                const MapSize& size = {});

/// A picture in `path` of so many nodes along its sides, all of them white.
void WriteWhitePicture(int side, const std::string& path);

}  // namespace pheromone::bench
