// What one daemon of a cluster knows of the log and of its peers, and decides: who leads, what is
// appended, what is committed. Sans I/O: time and messages go in, actions come out.
//
//   log->Follow(replica.follow_from(), ... replica.OnPage(page, now_ms));
//   replica.OnHeartbeat("b", heartbeat, now_ms);
//   if (replica.admits()) replica.Submit(sequence, record);
//   const Replica::Actions actions = replica.Next(now_ms);   // perform all of them, in this order
//   ... Next again after each input, and at replica.Deadline()
//
// election.h decides about roles, group_queue.h about groups; this connects them.
//
// Why it is safe. Everything before `next` is committed and applied here. A page shows the log at
// one moment, and together with the pages before it all of the log at that moment
// (replicated_log.h). From this follows:
//
// 1. What is handed out as committed is the log from the beginning, without a gap: a group is
//    handed out at its place only, after all before it, and once.
// 2. A new leader knows where the log ends. When TakeLead made T the leader's term, groups of other
//    terms could not be added any more, and none is added of term T before this process appends
//    one: T was granted to it and to no other (election.h). A page whose leader has term T is of
//    that moment or a later one, so with it all groups of the terms before are known. When Next has
//    handed out the last of them the role is kLeads, and only then are events admitted.
// 3. A leader's events are applied before they are committed; it has none when it begins. They
//    leave in groups, one at a time, each right after the last committed event, and the same group
//    again until the log answers for it: kCommitted, or a page shows it. If instead the log fences
//    it, or a page shows another group at its place, or a higher term and not all that was
//    submitted, then the rest never happened, and the state here is not the log's any more:
//    kDeposed. The process ends, and begins again from its journal, which has committed events
//    only. A leader without uncommitted events just follows again.
// 4. So one process writes in each term, the terms of groups never fall along the log, and what a
//    leader has committed is in the state of each later one.
//
// For this, the comparison of the term is enough. That of the empty place is for when 2 fails: two
// daemons were given one name, or the engine answered the first Follow after a restart from the
// past, so that a process takes the term of the one before for its own. Then one of them finds its
// place taken and ends, and no acknowledged event is lost.
//
// client_fw/verify/replica_world.h searches all interleavings for what contradicts this.
//
// No I/O, no clock. Not thread-safe. A value.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/cluster/election.h"
#include "server/cluster/group_queue.h"
#include "server/cluster/replica_settings.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

/// Why a daemon cannot follow the log; then it delivers nothing more and does not take the lead.
enum class LogGap : uint8_t {
  kNone,
  kTrimmed,   ///< what comes next was trimmed: it needs the state of a peer, and a new Replica
  kRewound,   ///< the log lacks what was applied here: it was lost, or an older one restored
  kOtherLog,  ///< the log has another ID: it was begun anew, or is another cluster's
  kDiverged,  ///< the state here is not the leader's: it needs the leader's, and a new Replica
};

/// And what becomes of it; empty for kNone.
std::string_view TextOf(LogGap gap);

class Replica {
 public:
  /// `next`: one after the last event that was applied here.
  Replica(ReplicaSettings settings, Sequence next, uint64_t now_ms);

  /// With which ReplicatedLog::Follow has to be called, once: from the last event that was applied,
  /// so that the first page shows whether the log has it.
  Sequence follow_from() const { return follow_from_; }

  void OnHeartbeat(const std::string& from, const Heartbeat& heartbeat, uint64_t now_ms);
  void OnPage(const Page& page, uint64_t now_ms);
  /// The answer to Actions::take_lead.
  void OnLead(const Result<Leader>& leader, uint64_t now_ms);
  /// The answer to Actions::append.
  void OnAppended(Appended outcome, uint64_t now_ms);
  /// An event with the next sequence, which is applied here. It must tell where it ends: records of
  /// a group are joined. If this daemon does not lead any more, it is deposed by that, since the
  /// event can never be committed. While it hands over, events are still accepted: an admitted one
  /// may arrive late.
  void Submit(Sequence sequence, std::string record);

  /// Whether the journal accepts events. One that does not never takes the lead, and hands it over
  /// as soon as a healthy peer is there.
  void SetHealthy(bool is_healthy) { election_.SetHealthy(is_healthy); }
  /// Ends this daemon's part for such a reason: it delivers nothing more and leads no more.
  void Bar(LogGap gap);
  /// Lets another one lead, `successor` if it is not empty: admits no more, commits what is
  /// submitted, then says so in its heartbeats. If nobody takes over within some suspect_ms it
  /// admits again. Has no effect unless it leads.
  void StepDown(const std::string& successor) { election_.StepDown(successor); }

  struct Actions {
    /// Groups that are committed, each exactly once, in order, without a gap. The first `own` of
    /// them were submitted here: they are applied already, to be written to the journal and
    /// answered. The others are to be applied, too. The very first one may begin before `next`:
    /// what was applied already is skipped.
    std::vector<Group> committed;
    size_t own = 0;
    /// kDeposed: what is uncommitted never happened. Nothing else will come.
    bool is_deposed = false;
    std::optional<Term> take_lead;       ///< ReplicatedLog::TakeLead(seen)
    std::optional<Group> append;         ///< ReplicatedLog::Append
    std::optional<Heartbeat> heartbeat;  ///< to all peers
  };
  Actions Next(uint64_t now_ms);
  /// When Next has something to do if nothing happens until then: 0 if at once, kNever.
  uint64_t Deadline() const;

  Role role() const { return is_deposed_ ? Role::kDeposed : election_.role(); }
  /// Whether an event may be applied and submitted.
  bool admits() const { return !is_deposed_ && election_.admits(); }
  /// Who leads as far as the log has told; term 0: nobody yet, or nothing was heard.
  const Leader& leader() const { return election_.leader(); }
  /// The last event that is known as committed here; Next may still have to hand it out.
  Sequence committed() const { return next_ - 1; }
  LogGap gap() const { return gap_; }
  /// Of the log; empty: it has none yet, or none was heard.
  const std::string& id() const { return id_; }

  /// All on which its decisions depend, except times and peers: for checkers, which take two with
  /// equal bytes for the same.
  void Encode(ByteWriter* writer) const;

 private:
  bool IsSameLog(const Page& page);
  void CheckFirst(const Page& page);
  void Receive(const Group& group, const Leader& leader, uint64_t now_ms);
  void CommitOwn();

  std::string id_;
  Election election_;
  GroupQueue queue_;
  Sequence next_;  // after the last committed event
  Sequence follow_from_;
  std::optional<Sequence> page_next_;  // after the last event of all pages, once there was one
  bool is_appending_ = false;          // an append is not answered
  bool has_caught_up_ = false;         // but the groups are not all handed out
  bool is_deposed_ = false;
  LogGap gap_ = LogGap::kNone;
  std::vector<Group> ready_;  // to be handed out as committed
  size_t ready_own_ = 0;
};

}  // namespace pheromone::cluster
