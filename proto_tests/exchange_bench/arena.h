// The map of exchange_bench, with more than a million nodes that hold pheromone, and requests with
// their correct answers.
//
//   const Arena arena = MakeArena(folder, links);   // writes folder/bench.toml and the files that
//   it names message = arena.Sense(client, pose);            // then compare with
//   arena.answers[pose]
//
// The map is 30 m x 30 m, unless more is asked for, with a node every 20 mm; a random half of them
// holds one quantum, which is the maximum; the pheromone is sensed up to r = 5 cells. Poses are
// random, on full nodes: a deposit of TRACE there changes nothing, so that the correct answer stays
// the same. A second pheromone, for roaming robots, evaporates within two seconds.
//
// The correct answers are computed by the engine itself, in this process: the benchmark checks that
// each request gets its own answer, complete and unchanged. The engine's correctness is tested
// elsewhere.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/frame.h"
#include "protocol/messages.h"

namespace pheromone::bench {

/// The links of the configuration, of each kind: "udp-1" and so on, "pty-1" and so on.
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
  /// Whether `answer` answers a request with these arguments.
  bool IsSenseAnswer(const protocol::Message& answer, uint8_t client, size_t pose) const;
  bool IsTraceAnswer(const protocol::Message& answer, uint8_t client, size_t pose,
                     uint8_t seq) const;
  /// Except for the intensities, which depend on the time.
  static bool IsRoamAnswer(const protocol::Message& answer, uint8_t client, uint8_t seq);
};

/// `extra` is appended to the configuration. Ends the process if it is invalid.
Arena MakeArena(const std::string& folder, const LinkNumbers& links, const std::string& extra,
                const MapSize& size = {});

/// Writes a white image of this many pixels along each side to `path`.
void WriteWhitePicture(int side, const std::string& path);

}  // namespace pheromone::bench
