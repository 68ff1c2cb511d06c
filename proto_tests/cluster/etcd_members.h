// Three members of etcd on this machine, for tests and benchmarks: Debian's, with free ports and
// folders of their own. They end with their owner.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/testing/temporary_folder.h"
#include "server/net/endpoint.h"

namespace pheromone::cluster {

/// TCP ports that nobody uses, all different.
std::vector<uint16_t> FreePorts(size_t count);

class EtcdMembers {
 public:
  static constexpr size_t kCount = 3;

  /// Starts all of them. Throws std::runtime_error if etcd cannot be started.
  EtcdMembers();
  EtcdMembers(const EtcdMembers&) = delete;
  EtcdMembers& operator=(const EtcdMembers&) = delete;
  ~EtcdMembers();

  /// For clients.
  const std::vector<Endpoint>& endpoints() const { return endpoints_; }
  /// With what it has on its disk. It runs already: nothing.
  void Start(size_t member);
  /// At once, as by a loss of power.
  void Kill(size_t member);
  /// The largest of all members.
  uint64_t DatabaseBytes() const;

 private:
  TemporaryFolder folder_;
  std::vector<Endpoint> endpoints_;
  std::vector<std::string> peers_;  // ADDRESS:PORT for the other members
  std::array<pid_t, kCount> processes_{};
};

}  // namespace pheromone::cluster
