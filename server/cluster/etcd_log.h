// The log in etcd, over the HTTP gateways of its members (etcd 3.4 and 3.5). etcd_format.h has the
// keys and values.
//
//   EtcdLog log(strand, {.members = {{"10.0.0.1", 2379}, ...}, .cluster = "lab", .new_id = id});
//
// A change is one transaction, or one for each MiB of a large group; its other branch reads what
// stands in its way, so that one answer decides. A follower reads up to the end and then watches;
// a watch that is silent for a second is begun again with a read, so that one whose member is cut
// off is noticed. News come once a second at least, as long as a majority of etcd responds.
// Another log than the first one that was seen, by its id, is an error as long as it is there.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "server/base/result.h"
#include "server/cluster/etcd_client.h"
#include "server/cluster/replicated_log.h"
#include "server/net/endpoint.h"

namespace pheromone::cluster {

struct EtcdSettings {
  std::vector<Endpoint> members;            ///< of etcd, in the order in which they are asked
  bool has_own_member = false;              ///< the first one is on this machine
  std::string cluster;                      ///< its name, without a slash
  std::string new_id;                       ///< the cluster's, if this node is its first leader
  std::chrono::milliseconds patience{500};  ///< for a member's answer, before the next is asked
  std::chrono::milliseconds silence{1000};  ///< of a watch, before it is begun again
  EtcdClient::OnMember on_member = nullptr;
};

class EtcdLog final : public ReplicatedLog {
 public:
  /// `executor` runs one thing at a time: a strand, or an io_context with one thread. Everything is
  /// called on it, also the destructor, which stops.
  EtcdLog(boost::asio::any_io_executor executor, EtcdSettings settings);
  ~EtcdLog() override;

  void TakeLead(Term seen, const std::string& node,
                std::function<void(const Result<Leader>&)> done) override;
  void Append(const Group& group, std::function<void(Appended)> done) override;
  void Follow(Sequence from, std::function<void(const Result<Page>&)> news) override;
  /// Frees the space of what an earlier Trim removed: by then everyone has read beyond it.
  void Trim(Sequence floor, std::function<void(const Status&)> done) override;
  void Transfer(std::function<void(const Status&)> done) override;
  void ReadRegister(const std::string& name,
                    std::function<void(const Result<Register>&)> done) override;
  /// Frees the space of old values now and then: nobody may trim an idle log.
  void SetRegister(const std::string& name, uint64_t seen, const std::string& value,
                   std::function<void(const Result<Register>&)> done) override;
  void Stop() override;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace pheromone::cluster
