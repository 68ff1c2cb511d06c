// One server of several that share a log: follows it, or leads, and passes on what another server
// has to decide. Connects replica.h, which decides, with the log, the peers, the service and the
// local log; those are given, so that tests run several servers in one thread.
//
// A server that cannot follow the log because it needs a state, since what comes next was trimmed
// or its own is not the leader's, takes that of a peer (state_receiver.h) and begins again from it.
// With another cluster's log, or one that lacks what was applied here, it does nothing more than
// answer queries, and says why.
//
//   Cluster cluster(settings, next_sequence, false, replicated_log, parts);
//   service.OnChange([&](const engine::Event& event) { return cluster.Forward(event); });
//   cluster.Start();
//   ... cluster.OnMessage(from, message);   // and OnUp, OnDown: what the peers tell
//   ... cluster.Continue();                 // at the time that `parts.wake_at` was told
//   cluster.Stop();
//
// Everything is called on one executor, that of the log and of the peers, and calls back there,
// except for Forward and view, which any thread may call.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/cluster/cluster_log.h"
#include "server/cluster/peer_wire.h"
#include "server/cluster/replica.h"
#include "server/cluster/replicated_log.h"
#include "server/cluster/state_hashes.h"
#include "server/cluster/state_receiver.h"
#include "server/cluster/state_sender.h"
#include "server/core/engine/service/service.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::cluster {

/// For information.
struct ClusterView {
  Role role = Role::kFollows;
  Leader leader;
  std::string id;            ///< of the cluster; empty: not known yet
  uint64_t committed = 0;    ///< the last event that is known as committed here
  uint64_t behind = 0;       ///< events that a peer knows as committed, and this one does not
  uint64_t news_ms = 0;      ///< when the log was heard last, by the steady clock
  uint64_t elections = 0;    ///< how often another leader was seen
  uint64_t fenced = 0;       ///< appends that were refused, because another one leads
  uint64_t forwarded = 0;    ///< messages passed to the leader
  uint64_t divergences = 0;  ///< states of others, or this one, that were not the leader's
  LogGap gap = LogGap::kNone;
  std::string trouble;   ///< of the engine of the log; empty: none
  std::string transfer;  ///< of a state, as text; empty: none
};

class Cluster {
 public:
  struct Parts {
    engine::Service* service = nullptr;
    ClusterLog* log = nullptr;
    engine::OrderedLog* local = nullptr;  ///< the journal: it has to admit what is followed

    std::function<uint64_t()> now_ms;  ///< of a steady clock
    /// Continue has to be called then, or earlier; UINT64_MAX: when something happens.
    std::function<void(uint64_t)> wake_at;
    /// From any thread, under the service's lock: the message goes to that peer.
    std::function<void(const std::string& to, PeerMessage message)> send;
    std::function<void(const PeerMessage&)> send_all;
    /// Answers and commands for robots that are connected here.
    std::function<void(const std::vector<engine::Outgoing>&)> deliver;
    /// It leads from here on, or leads no more.
    std::function<void(bool)> on_lead;
    /// This process is of no use any more, and has to begin again from its journal.
    std::function<void(const std::string& why)> restart;
    /// An operator's change that a peer has forwarded, and its result.
    std::function<void(const OperatorChange&, std::function<void(OperatorResult)>)> change;
    /// Halts the robots that are connected here.
    std::function<void()> halt;

    /// The ID of the log is known, before anything of it is applied: to be made durable beside the
    /// journal. Errors end the process.
    std::function<Status(const std::string& id)> on_id;
    /// As StateSender, for peers.
    std::function<std::unique_ptr<journal::StateSource>()> freeze;
    RunAside aside;
    /// Of the journal, for the state of a peer.
    journal::Folder* folder = nullptr;
    /// As StateReceiver: the state here is not to be kept.
    std::function<void()> end_snapshots;
    /// Something that an operator has to know.
    std::function<void(const std::string& text)> warn;
  };

  /// `next`: one after the last event of the service. `founds`: the log is empty, and is to begin
  /// after these events with the ID in the settings. `log` and all parts outlive it.
  Cluster(ReplicaSettings settings, Sequence next, bool founds, ReplicatedLog* log, Parts parts);
  Cluster(const Cluster&) = delete;
  Cluster& operator=(const Cluster&) = delete;

  void Start();
  void Continue();
  void OnMessage(const std::string& from, const PeerMessage& message);
  void OnUp(const std::string& node);
  void OnDown(const std::string& node);
  void StepDown(const std::string& successor);
  /// A message that was given to `parts.send` has not been sent.
  void OnNotSent(const PeerMessage& message);
  /// Answers those who wait for another server, and passes on nothing from then on.
  void EndForwarding();
  /// The same; then calls nobody any more.
  void Stop();

  /// Passes an event to the leader; false if this server leads, or none can be reached. Under the
  /// service's lock, from any thread.
  bool Forward(const engine::Event& event);
  /// Passes on an operator's change; `done` is called once, by the executor, at the latest when the
  /// leader's connection ends or this server stops. False, without calling: as Forward. Any thread.
  bool Forward(OperatorChange change, std::function<void(OperatorResult)> done);
  ClusterView view() const;
  /// Whether another server leads and is reached. Any thread.
  bool has_leader() const {
    const std::lock_guard lock(mutex_);
    return !leader_up_.empty();
  }

 private:
  struct Awaited {
    std::string by;  // the leader that was asked
    std::function<void(OperatorResult)> done;
  };

  void Follow();
  void OnNews(const Result<Page>& page);
  bool Found(const Page& page);
  bool NoteId();
  void NoteHashes();
  void Compare(const std::string& from, const Heartbeat& beat);
  void DropState(const std::string& why);
  void Join(uint64_t now_ms);
  void OnJoined(const Result<uint64_t>& sequence);
  std::string DescribeTransfer() const;
  Status Apply(const Group& group);
  bool ApplySome();
  void SetLead(bool leads);
  void EndLead();
  void BeginLead();
  void TrimSometimes(uint64_t now_ms);
  std::string Stall(uint64_t now_ms);
  void TellView();
  void Accept(const std::string& from, const ForwardedRequest& request);
  void Accept(const ForwardedEvent& event);
  void Accept(const PosesHeard& heard);
  void TellPoses(uint64_t now_ms);
  uint64_t FieldTime() const;
  void Finish(const OperatorResult& result);
  template <typename IsLost>
  void FinishLost(const std::string& why, IsLost&& is_lost);

  const ReplicaSettings settings_;
  ReplicatedLog* const log_;
  const Parts parts_;
  Replica replica_;
  StateSender sender_;
  StateReceiver receiver_;
  StateHashes hashes_;
  bool founds_;
  std::string noted_id_;
  std::deque<Group> to_apply_;             // while the local log does not admit more
  std::set<std::string> up_;               // peers
  std::map<std::string, Heartbeat> told_;  // by those that are up, the last
  Sequence floor_ = 1;
  uint64_t join_ms_ = 0;      // not before
  std::string join_asked_;    // the peer that was asked last
  std::string join_trouble_;  // why that did not give its state
  uint64_t divergences_ = 0;
  uint64_t news_ms_ = 0;
  Sequence committed_ = 0;      // the last, when there was progress
  uint64_t progress_ms_ = 0;    // of what is submitted
  bool waited_ = false;         // something was uncommitted at the last look
  uint64_t trim_ms_ = 0;        // not before
  uint64_t poses_ms_ = 0;       // likewise
  uint64_t told_poses_ms_ = 0;  // those heard until then, in field time
  bool is_trimming_ = false;
  Sequence trimmed_ = 1;
  bool is_stopped_ = false;

  mutable std::mutex mutex_;
  // Under mutex_:
  std::string leader_up_;  // the leader, if it is another node and connected
  bool forwards_ = true;   // false: there is none for good
  std::map<uint64_t, Awaited> awaited_;
  uint64_t last_number_ = 0;
  ClusterView view_;
};

}  // namespace pheromone::cluster
