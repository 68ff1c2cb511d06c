// Two servers with one log, beside one alone.
#pragma once

#include <string>

#include "proto_tests/exchange_bench/measure.h"
#include "proto_tests/exchange_bench/report.h"

namespace pheromone::bench {

struct ClusterOptions {
  std::string pheromoned;
  std::string folder;  ///< on the disk of all journals; etcd's are with temporary files
  int clients = 64;
  int many_clients = 2'032;
  Effort effort;
  double lasting_seconds = 60;  ///< of changes by many clients
};

/// SENSE asked of a follower in turn with a server alone; changes asked of that one, of the leader
/// and of the follower, with the disk's own time; then changes for a while, with the size of etcd's
/// database. All on this machine, which is not what a cluster is for: the servers share its
/// processors with three etcd and the clients.
void RunCluster(const ClusterOptions& options, Report* report);

}  // namespace pheromone::bench
