// What a daemon of a cluster is told about itself, its peers and its times: see replica.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace pheromone::cluster {

/// For deadlines, in ms: nothing is due.
constexpr uint64_t kNever = std::numeric_limits<uint64_t>::max();

struct ReplicaSettings {
  std::string node;                ///< this daemon's
  std::vector<std::string> nodes;  ///< all, this one too, in the order in which they take over
  std::string id{};  ///< of the log that this daemon's events are from; empty: it has none yet
  uint64_t heartbeat_ms = 50;  ///< also: how much later the next in order takes over, and the pause
                               ///< after a request without an answer
  uint64_t suspect_ms = 300;   ///< a leader that gives no sign for that long is suspected
  uint64_t meet_ms = 1'500;    ///< one that was not heard yet: to connect may take so long
  uint64_t group_ms = 5;       ///< groups are begun at least this far apart
  size_t group_bytes = size_t{64} << 10;  ///< of a group, unless one event is larger
};

}  // namespace pheromone::cluster
