// Daemons of one cluster and their log, for the question whether an acknowledged change can be lost
// or made twice: the real cluster::Replica of each, and between them and a model of the log
// (log_model.h) requests and answers that are lost, late and doubled.
//
// A change is what a robot asks for until it is acknowledged: any leader that does not have it in
// its state may submit it, the next one too, as the engine's memory of requests does. Its record
// names the process that submitted it, as a stamp would.
//
// Time. All timers of a daemon expire whenever they like, together, in a step of its own: nothing
// rests on clocks, so heartbeats, which decide only about time, are not delivered. A pause is a
// daemon that no step is taken of while others go on and its requests arrive. Not part of Key are
// therefore the times inside of Replica: after each step none is due, and the next step of time
// is later than all of them.
//
// A crash is followed by a restart from the journal, which has the committed events that were
// handed out, or a part of them, or none: a new machine. A deposed daemon restarts, too.
//
// Nodes differ in nothing but their names: of those that have not asked for the lead yet, the first
// in order is the next to do so.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client_fw/verify/explore.h"
#include "client_fw/verify/log_model.h"
#include "server/cluster/replica.h"

namespace pheromone::verify {

/// Daemons that treat what Replica says wrongly.
enum class DaemonMutant : uint8_t {
  kNone,
  kReleasesEarly,     ///< acknowledges what is not committed yet
  kResendsElsewhere,  ///< after kUnknown it appends the group at the log's end, not at its place
  kContinues,         ///< a deposed one keeps its state and follows again
};

/// What may happen, and how often.
struct ReplicaLimits {
  size_t nodes = 3;
  int changes = 2;      ///< different ones
  int asks = 3;         ///< for the lead
  int unknowns = 1;     ///< requests without an answer: lost, late, or their answer is lost
  int crashes = 0;      ///< of daemons, followed by a restart
  int stale_reads = 0;  ///< restarts after which the first page may show any moment of the past
  int step_downs = 0;
  int doubles = 0;  ///< requests that are executed and arrive once more, any time later
  /// Judges what is in the log and journals, not whether each leader has it in its state.
  bool only_the_log = false;
  LogMutant log = LogMutant::kNone;
  DaemonMutant daemon = DaemonMutant::kNone;
};

class ReplicaWorld {
 public:
  explicit ReplicaWorld(const ReplicaLimits& limits);

  std::string Key() const;
  /// Empty, or what went wrong.
  std::string Wrong() const;
  /// All changes are in the log.
  bool Finished() const;
  /// A daemon has the lead or may still ask for it, so that nothing may keep the rest from being
  /// made.
  bool MustFinish() const;

  using Visit = std::function<void(std::string step, ReplicaWorld successor)>;
  void Next(const Visit& visit) const;

 private:
  // A request that the log has not executed, or will execute again.
  struct Request {
    size_t node = 0;
    bool is_awaited = false;            // by the process that sent it
    std::optional<cluster::Term> seen;  // TakeLead, or:
    cluster::Group group;
    bool operator==(const Request&) const = default;
  };

  struct Node {
    explicit Node(cluster::Replica started) : replica(std::move(started)) {}

    cluster::Replica replica;
    uint64_t now_ms = 0;
    uint8_t process = 0;    // how many before this one
    std::string journal;    // records of committed events
    std::string state;      // records of applied events
    size_t first_page = 0;  // its first page is not of an earlier moment
    size_t shown = 0;       // the moment of its last page
    bool has_page = false;
    bool has_asked = false;                          // once, for the lead
    std::optional<cluster::Leader> lead_answer;      // on its way
    std::optional<cluster::Appended> append_answer;  // on its way
    bool awaits_lead = false;
    bool awaits_append = false;
    cluster::Sequence unanswered = 0;  // for kResendsElsewhere: the place of what was kUnknown
    std::string key;                   // of all that; made by Settle
  };

  void Edit(size_t node, const std::function<void(Node*)>& edit);
  cluster::Replica Start(size_t node, cluster::Sequence next, uint64_t now_ms) const;
  void Perform(size_t node, Node* it);
  void Settle(size_t node, Node* it);
  void Restart(size_t node, Node* it, size_t events, bool is_stale);
  void Deliver(size_t node, Node* it, const cluster::Group& group, bool is_own);
  void Acknowledge(const std::string& records, cluster::Term term);
  void Send(Request request);
  void Execute(size_t place, bool also_later);
  bool GiveUp(size_t node, bool is_append, bool is_lost);
  void Forget();
  void NextOfNode(size_t node, const Visit& visit) const;
  void NextOfTime(size_t node, const Visit& visit) const;
  void NextOfRequests(const Visit& visit) const;
  std::string WrongInLog() const;
  std::string WrongAt(size_t node) const;

  ReplicaLimits left_;
  LogModel log_;
  std::vector<std::shared_ptr<const Node>> nodes_;
  std::vector<Request> requests_;
  int introduced_ = 0;                       // changes that were submitted once
  std::vector<cluster::Term> acknowledged_;  // by change: the term; 0: not
  std::string fault_;
};

/// All that may happen within the limits, from daemons that have just been started for the first
/// time.
Explored ExploreReplicas(const ReplicaLimits& limits, size_t max_states = 1'000'000);

}  // namespace pheromone::verify
