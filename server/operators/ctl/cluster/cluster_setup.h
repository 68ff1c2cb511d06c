// pheromonectl cluster setup: a folder for each machine of a cluster, with all that it needs.
#pragma once

#include <string>
#include <vector>

namespace pheromone::ctl {

struct ClusterSetup {
  std::vector<std::string> machines;  ///< NAME=ADDRESS
  std::vector<std::string> witnesses;
  std::string name = "lab";
  std::string output;      ///< the folder; empty: cluster-NAME
  bool overwrite = false;  ///< also the secret, which is another one then
};

/// Prints what was made, and returns the exit status (server_call.h). kUsage: what was asked for
/// makes no cluster. The secret is written to files of their owner's only, and never printed.
int SetUpCluster(const ClusterSetup& setup);

}  // namespace pheromone::ctl
