// The machines of a cluster that is to be, and the files that make one of each: settings of etcd,
// the [cluster] of pheromoned's configuration, units, firewall, and what to do with them.
//
//   PHEROMONE_TRY(const ClusterPlan plan, PlanCluster("lab", {"a=10.0.0.1", ...}, {"witness"}));
//   for (const ClusterMachine& machine : plan.machines) {
//     for (const PlannedFile& file : FilesOf(plan, machine, random)) { ... }
//   }
//
// Pure; any thread.
#pragma once

#include <string>
#include <vector>

#include "server/base/result.h"

namespace pheromone::ctl {

struct ClusterMachine {
  std::string name;
  std::string address;      ///< numeric, IPv4 or IPv6 without brackets
  bool is_witness = false;  ///< has a member of etcd, and no server
  bool operator==(const ClusterMachine&) const = default;
};

struct ClusterPlan {
  std::string name;
  std::vector<ClusterMachine> machines;  ///< in the order of the command line
};

/// `machines`: NAME=ADDRESS; one that is named "witness" is a witness, as are `witnesses`. Errors
/// name the value and what is expected: names and addresses that the configuration accepts, all
/// different; 3, 5, 7 or 9 machines, two of them with a server.
Result<ClusterPlan> PlanCluster(const std::string& name, const std::vector<std::string>& machines,
                                const std::vector<std::string>& witnesses);

/// Different for each cluster, also for one that is made again.
struct ClusterRandom {
  std::string secret;  ///< hexadecimal digits, as secret_file has them
  std::string token;   ///< keeps members of etcd of another cluster away; no secret
};

struct PlannedFile {
  std::string name;
  std::string text;
  bool is_secret = false;  ///< for its owner only
};

/// README.txt says where each is to be copied.
std::vector<PlannedFile> FilesOf(const ClusterPlan& plan, const ClusterMachine& machine,
                                 const ClusterRandom& random);

}  // namespace pheromone::ctl
