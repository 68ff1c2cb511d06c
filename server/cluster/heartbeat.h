// What a daemon of a cluster tells each peer every heartbeat_ms (replica_settings.h), and at once
// when `leads` changes: what it knows of the log, and is. election.h decides the first part; what
// the state is comes from ClusterLog::StateHash.
#pragma once

#include <cstdint>
#include <string>

#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

struct Heartbeat {
  Term term = 0;            ///< the highest that it knows
  bool leads = false;       ///< in that term, and nobody else shall
  bool is_healthy = true;   ///< it could lead: its journal accepts events
  Sequence next = 1;        ///< one after the last committed event that it knows
  std::string successor{};  ///< who shall lead after it; empty: anybody

  uint64_t hashed = 0;  ///< a recent event; 0: there was none yet
  uint64_t hash = 0;    ///< of the sender's state after it
  bool operator==(const Heartbeat&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("term", it.term);
    visit("leads", it.leads);
    visit("is_healthy", it.is_healthy);
    visit("next", it.next);
    visit("successor", it.successor);
    visit("hashed", it.hashed);
    visit("hash", it.hash);
  }
};

}  // namespace pheromone::cluster
