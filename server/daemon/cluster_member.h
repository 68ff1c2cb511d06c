// One server of a cluster: the thread, sockets and timers around server/cluster.
//
//   std::unique_ptr<ClusterMember> member = MakeMember(config, journal.get());
//   engine::Service service(member->log(), ...);
//   Status begun = member->Start({.service = &service, ...});
//   switch (member->AwaitBegin()) ...         // until this server leads or follows
//   ...
//   member->HandOver();                       // an orderly stop: another server leads at once
//   member->EndForwarding();
//   member->Stop();
//
// Thread-safe from Start to Stop, which one thread calls.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/base/result.h"
#include "server/cluster/cluster.h"
#include "server/cluster/cluster_log.h"
#include "server/cluster/etcd_client.h"
#include "server/cluster/peers.h"
#include "server/cluster/replicated_log.h"
#include "server/config/config.h"
#include "server/core/engine/service/service.h"
#include "server/daemon/journal_owner.h"
#include "server/daemon/live_control.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::daemon {

/// The cluster's log, as this machine reaches it. `on_member`: of etcd.
std::unique_ptr<cluster::ReplicatedLog> MakeReplicatedLog(
    const boost::asio::any_io_executor& executor, const config::ClusterSettings& settings,
    const std::string& id_to_found = "", cluster::EtcdClient::OnMember on_member = nullptr);

class ClusterMember {
 public:
  /// This machine's journal; it outlives the member.
  struct Local {
    engine::OrderedLog* log = nullptr;
    uint64_t last = 0;  ///< its last event
    journal::Folder* folder = nullptr;
    std::string id;       ///< of the cluster's log; empty: not known yet
    bool founds = false;  ///< that log has to be empty, and begins after this journal
    /// The ID is known: it has to become durable.
    std::function<Status(const std::string& id)> note_id;
    /// As cluster::StateReceiver.
    std::function<void()> end_snapshots;
  };
  ClusterMember(const config::ClusterSettings& settings, uint64_t links_hash, Local local);
  ClusterMember(const ClusterMember&) = delete;
  ClusterMember& operator=(const ClusterMember&) = delete;
  ~ClusterMember();

  engine::OrderedLog* log() { return &log_; }

  /// Outlive the member; called by its thread.
  struct Uses {
    engine::Service* service = nullptr;
    std::function<void(const std::vector<engine::Outgoing>&)> deliver;
    std::function<void()> committed;  ///< answers may be released
    /// The process has to begin again from its journal.
    std::function<void(const std::string& why)> restart;
    std::function<void(const cluster::OperatorChange&,
                       std::function<void(cluster::OperatorResult)>)>
        change;
    std::function<void()> halt;  ///< halts the robots here
    /// Any thread; null while there is no state, or another one is being copied.
    std::function<std::unique_ptr<journal::StateSource>()> freeze;
  };
  /// Errors: the other servers cannot reach this one.
  Status Start(Uses uses);

  enum class Begun {
    kLeads,    ///< and the state may have no configuration yet
    kFollows,  ///< a state with a configuration; or, for good, none that it could follow
    kStopped,  ///< Interrupt was called
  };
  /// Waits until the log says so, and tells progress to the service manager.
  Begun AwaitBegin();
  void Interrupt();

  /// For the service, which calls under its lock.
  bool Forward(const engine::Event& event) { return cluster_->Forward(event); }
  LiveCluster live();

  /// Lets another server lead, and waits for that a short while; then nothing that was made here is
  /// uncommitted, if all is well.
  void HandOver();
  /// Whether the journal has, or will have, all that the service has applied.
  bool is_committed() const { return log_.DurableSequence() == log_.appended(); }
  /// Answers operators who wait for another server, soon, and passes on nothing from then on.
  void EndForwarding();
  /// When nobody calls any more.
  void Stop();

 private:
  void Wake();
  void WakeAt(uint64_t at_ms);
  void Send(const std::string& to, cluster::PeerMessage message);
  control::ClusterView View() const;
  void HaltPeers();
  void StepDown(const std::string& successor, const control::Control::Done& done);
  void ReportPeers();
  std::string DescribeWait() const;
  Status NoteId(const std::string& id);

  const config::ClusterSettings settings_;
  const Local local_;
  Uses uses_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  boost::asio::steady_timer timer_;
  std::thread thread_;
  boost::asio::thread_pool aside_{1};  // states are copied and written there
  cluster::ClusterLog log_;
  std::unique_ptr<cluster::ReplicatedLog> replicated_;
  std::unique_ptr<cluster::Peers> peers_;
  std::unique_ptr<cluster::Cluster> cluster_;
  std::atomic<bool> wakes_{false};
  std::atomic<size_t> sending_{0};
  uint64_t told_ms_ = 0;  // when others saw the peers' states last

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Under mutex_:
  bool interrupted_ = false;
  std::vector<cluster::PeerState> peer_states_;

  std::map<std::string, std::set<std::string>> told_down_;  // the thread's: why there is no peer
};

/// Of the cluster that the configuration names; null: this server is alone. The journal outlives
/// it.
std::unique_ptr<ClusterMember> MakeMember(const config::Config& config, JournalOwner* journal);

}  // namespace pheromone::daemon
