// The ordered log of one of several servers: what this one appends while it leads becomes durable
// when a majority has it (replica.h); what another one appended is followed. The journal of this
// machine, the local log, receives committed events only, in both cases, so that it is always a
// prefix of the shared log: a server that was deposed restarts from it.
//
//   ClusterLog log(&journal, last_sequence, [] { post(submit) });
//   log.Lead();                                   // from here on changes are admitted
//   for (auto& it : log.CollectSubmitted()) replica.Submit(it.sequence, it.record);
//   log.Commit(sequence);                         // the local log gets them, answers are released
//
// The local log and the callbacks outlive it. Admit, Append, Account, IsRotationDue and Rotate
// under the service's lock; CollectSubmitted, Lead, EndLead and Commit in one thread; the rest in
// any.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "protocol/opcodes.h"
#include "server/core/engine/service/ordered_log.h"

namespace pheromone::cluster {

class ClusterLog final : public engine::OrderedLog {
 public:
  struct Options {
    uint64_t last = 0;            ///< the sequence of the local log's last event
    size_t max_pending = 20'000;  ///< events that are not committed; beyond it, changes are refused
    std::function<void()> submitted = [] {};  ///< there is something to collect; do not call back
    std::function<void()> committed = [] {};  ///< answers may be released; in Commit
  };
  ClusterLog(OrderedLog* local, Options options)
      : local_(local),
        options_(std::move(options)),
        appended_(options_.last),
        committed_(options_.last) {}

  protocol::Reason Admit() override;
  uint64_t Append(const engine::Stamp& stamp, const engine::Event& event) override;
  void Account(uint64_t cost) override { local_->Account(cost); }
  bool IsRotationDue() const override;
  void Rotate(uint64_t state_hash) override;
  uint64_t DurableSequence() const override;
  bool WhenDurable(uint64_t sequence, std::function<void()> done) override;
  std::string Trouble() const override;

  /// Admits changes, whatever the trouble was. Everything in the shared log has been followed.
  void Lead();
  /// Admits no more; what is pending may still be committed. What is appended from here on is
  /// followed.
  void EndLead();
  bool leads() const;
  /// Why changes are refused, while it is not empty.
  void SetTrouble(std::string trouble);

  struct Submitted {
    uint64_t sequence = 0;
    std::string record;  ///< journal::AppendEvent
  };
  /// The events appended since the last call, encoded.
  std::vector<Submitted> CollectSubmitted();
  /// The state after certain events, the first of each kHashEveryMs of field time: the same events
  /// on each server. Those since the last call.
  static constexpr uint64_t kHashEveryMs = 10'000;
  struct StateHash {
    uint64_t sequence = 0;
    uint64_t hash = 0;
  };
  std::vector<StateHash> CollectHashes();
  /// Everything up to here is committed: what this server appended goes to the local log.
  void Commit(uint64_t sequence);

  /// Of the last event that was appended.
  uint64_t appended() const;

 private:
  struct Pending {
    uint64_t sequence = 0;  // 0: the hash after the event before
    uint64_t hash = 0;
    engine::Stamp stamp;
    engine::Event event;
  };
  struct Waiter {
    uint64_t sequence = 0;
    std::function<void()> done;
  };

  OrderedLog* const local_;
  const Options options_;
  mutable std::mutex mutex_;
  // Under mutex_:
  bool leads_ = false;
  uint64_t appended_;
  uint64_t committed_;
  size_t collected_ = 0;                   // of pending_
  bool rotates_ = false;                   // a hash is pending
  bool notes_hash_ = false;                // of the state after the last event
  std::optional<uint64_t> hash_interval_;  // of the last event
  std::vector<StateHash> hashes_;
  std::deque<Pending> pending_;
  std::vector<Waiter> waiters_;
  std::string trouble_ = "no leader yet";
};

}  // namespace pheromone::cluster
