// Who leads, as one daemon sees it: when it suspects the leader, asks the log for the lead, has it,
// hands it over, and loses it.
//
//   election.OnHeartbeat("b", heartbeat, now_ms);   // of peers
//   election.OnLeader(page.leader, now_ms);         // of the log
//   if (const std::optional<Term> seen = election.Ask(now_ms)) log->TakeLead(*seen, ...)
//   ... again at election.Deadline()
//
// The leader is suspected when its heartbeats are silent and the log shows no progress, neither
// groups nor a new leader, for suspect_ms; for meet_ms before the first of its heartbeats, since
// there may be no connection yet. Whoever comes later in the order of nodes waits longer
// by heartbeat_ms for each healthy peer that comes before. None of this is needed for safety: the
// log grants each term to one node, and a suspicion too early costs only time. A daemon that did
// not run for a while itself, half of suspect_ms, has not read what it was sent, and begins anew.
//
// Own terms. The log names the leader's node. That is this process only if the term is the first
// that it sees after having asked for the lead: any other was granted to an earlier process of the
// same node, which may have groups on their way. So after a restart its own old term is like that
// of a leader who is gone, and is taken again at once. An answer that was lost needs no care: if
// the lead was granted, the log says so; if not, the same term is asked for again.
//
// Handing over: a leader that is asked to, or whose journal is not healthy while a peer's is,
// admits no more changes; when nothing is uncommitted any more its heartbeats say that it does not
// lead. The others then take over without suspicion. Until one has, it leads on in the log, and
// admits again if nobody takes over. One that gets no answer from the log for long says the same: a
// peer may reach it.
//
// No I/O, no clock. Not thread-safe.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/cluster/heartbeat.h"
#include "server/cluster/replica_settings.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

enum class Role : uint8_t {
  kFollows,
  kTakes,      ///< has asked the log for the lead
  kCatchesUp,  ///< has the lead; what earlier leaders wrote is not all applied
  kLeads,      ///< orders events
  kDeposed,    ///< has applied events that never will be committed: of use to nobody (replica.h)
};

class Election {
 public:
  Election(ReplicaSettings settings, uint64_t now_ms);

  void OnHeartbeat(const std::string& from, const Heartbeat& heartbeat, uint64_t now_ms);
  /// The leader in the log, of any page.
  void OnLeader(const Leader& leader, uint64_t now_ms);
  /// There was a new group in the log.
  void OnProgress(uint64_t now_ms) { sign_ms_ = now_ms; }
  /// The answer to TakeLead.
  void OnLead(const Result<Leader>& now_leading, uint64_t now_ms);
  /// It has the lead, and all that earlier leaders wrote is applied.
  void OnCaughtUp();

  /// Whether this daemon could lead: its journal accepts events. At first: yes.
  void SetHealthy(bool is_healthy) { is_healthy_ = is_healthy; }
  /// For good: it cannot follow the log, so it does not lead.
  void Bar();
  /// Hands over, to `successor` or, if empty, to anybody. Has no effect unless it leads.
  void StepDown(const std::string& successor);

  /// TakeLead has to be called now, with this term as seen. Is asked at least at each Deadline.
  std::optional<Term> Ask(uint64_t now_ms);
  /// What has to be sent to all peers now. `is_drained`: nothing is uncommitted. `waits_since_ms`:
  /// since when a group is on its way into the log; kNever: there is none.
  std::optional<Heartbeat> NextHeartbeat(bool is_drained, uint64_t waits_since_ms, Sequence next,
                                         uint64_t now_ms);
  /// When Ask or NextHeartbeat has something new if nothing is heard until then; kNever.
  uint64_t Deadline() const;

  Role role() const { return role_; }
  const Leader& leader() const { return leader_; }
  /// It leads and does not hand over.
  bool admits() const { return role_ == Role::kLeads && !hands_over_; }
  const ReplicaSettings& settings() const { return settings_; }

  /// All on which its decisions depend, except times and peers: for checkers.
  void Encode(ByteWriter* writer) const;

 private:
  struct Peer {
    uint64_t heard_ms = 0;
    bool is_healthy = false;
  };

  uint64_t TakeoverMs() const;
  uint64_t TurnMs() const;
  bool HasHealthyPeer(uint64_t now_ms) const;

  ReplicaSettings settings_;
  Role role_ = Role::kFollows;
  Leader leader_;
  bool knows_leader_ = false;  // there was a page
  bool is_healthy_ = true;
  bool is_barred_ = false;

  bool has_asked_ = false;  // for the lead after leader_.term; it may have been granted
  bool is_asking_ = false;  // a TakeLead is not answered
  uint64_t ask_again_ms_ = 0;

  uint64_t awake_ms_;  // when it was last asked
  uint64_t sign_ms_;   // the leader's last sign of life, or since when there should be one
  bool has_heard_leader_ = false;
  bool is_vacant_ = false;  // the leader says that it does not lead
  std::string successor_;   // its, if so
  std::map<std::string, Peer> peers_;

  bool hands_over_ = false;
  std::string own_successor_;
  std::optional<uint64_t> vacated_ms_;  // since when its heartbeats say that it does not lead
  uint64_t beat_ms_ = 0;                // when the next is due
  bool has_told_lead_ = false;          // in the last one
};

}  // namespace pheromone::cluster
