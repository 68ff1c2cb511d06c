// The log that the daemons of a cluster share: groups of encoded events in one order, kept by a
// majority of machines. An existing engine keeps it (etcd_log.h); this is all that is asked of it.
//
//   log->TakeLead(seen, "a", [](const Result<Leader>& now) { ... });
//   log->Append({.first = 1201, .term = now.term, .records = ...}, [](Appended outcome) { ... });
//   log->Follow(1201, [](const Result<Page>& page) { ... });
//
// Safety rests on two comparisons that the engine makes in one step with the change: TakeLead
// succeeds only while the leader's term is `seen`, Append only while the term is the leader's and
// the place is empty. It rests on no lock, no lease and no clock.
//
// Not thread-safe: called, and calling back, on one executor; never inside the call. One TakeLead,
// one Append, one Trim, one Follow and one call for each register at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/base/result.h"

namespace pheromone::cluster {

/// Rises with each leader; 0: there was none yet.
using Term = uint64_t;
/// Of an event in the log, from 1 (engine::OrderedLog).
using Sequence = uint64_t;

struct Leader {
  Term term = 0;
  std::string node;
  bool operator==(const Leader&) const = default;
};

/// Events with successive sequences, written at once. Its place is the sequence of the first.
struct Group {
  Sequence first = 0;
  uint32_t count = 0;   ///< of events; not 0
  Term term = 0;        ///< of the leader that wrote it
  std::string records;  ///< opaque; of any size: an engine with a limit splits it itself
  bool operator==(const Group&) const = default;
};

/// News of the log: what it is at one moment. The moments of one Follow never go back, and the
/// first is not before its call. Up to each page, Follow has told all that was in the log at its
/// moment, from `from` on, each group once. So with a page whose leader has term T every group of
/// the terms before is known: when T began, the last of them was there already. An engine that
/// reads in portions names that leader with the last portion, and before it none (term 0) or the
/// one before.
struct Page {
  std::string id;      ///< of the cluster; made with the first leader
  Leader leader;       ///< at the moment of this page
  Sequence floor = 1;  ///< what is before was trimmed, and is not told
  /// One after the last event of the log, or of what was read of it so far. If it is below the
  /// sequence that is followed from, the log has lost events: it was restored from a backup.
  Sequence next = 1;
  std::vector<Group> groups;  ///< in order, without a gap; may be empty
  bool operator==(const Page&) const = default;
};

enum class Appended : uint8_t {
  kCommitted,  ///< a majority has it on its disks
  kFenced,   ///< another one leads, or wrote at this place; it is not in the log and never will be
  kUnknown,  ///< no answer: it may be in the log. Appending the same again says
};

/// A small value beside the log.
struct Register {
  uint64_t revision = 0;  ///< of its last change; rises with each. 0: it was never set
  std::string value;
  bool operator==(const Register&) const = default;
};

class ReplicatedLog {
 public:
  ReplicatedLog() = default;
  ReplicatedLog(const ReplicatedLog&) = delete;
  ReplicatedLog& operator=(const ReplicatedLog&) = delete;
  virtual ~ReplicatedLog() = default;

  /// Makes `node` the leader if the term is still `seen`. The result is the leader now, this node
  /// or another one; with a term that is not above `seen`, this node's earlier life. Errors: no
  /// answer; it may have succeeded.
  virtual void TakeLead(Term seen, const std::string& node,
                        std::function<void(const Result<Leader>&)> done) = 0;
  /// Writes a group if `group.term` is still the leader's and its place is empty, or has the same
  /// group already.
  virtual void Append(const Group& group, std::function<void(Appended)> done) = 0;

  /// Calls `news` with the group that contains `from` and all that follow, as they are committed,
  /// and when the leader changes: the first time soon, with what there is. Errors are told, too,
  /// and it goes on by itself, without a gap, when the engine responds again. Until it is called
  /// again or Stop. If `from` is before the floor, groups begin at the floor; so do they when the
  /// floor overtakes a follower that is behind. It may be called with nothing new.
  virtual void Follow(Sequence from, std::function<void(const Result<Page>&)> news) = 0;

  /// Forgets groups that end before `floor`. Errors: no answer.
  virtual void Trim(Sequence floor, std::function<void(const Status&)> done) = 0;
  /// Moves the engine's own leadership to the member on this machine, if there is one.
  virtual void Transfer(std::function<void(const Status&)> done) = 0;
  /// The register of this name, as a majority has it.
  virtual void ReadRegister(const std::string& name,
                            std::function<void(const Result<Register>&)> done) = 0;
  /// Sets it, if its revision is still `seen`. The result is the register now, set by this or by
  /// another one. Errors: no answer; it may be set, even later.
  virtual void SetRegister(const std::string& name, uint64_t seen, const std::string& value,
                           std::function<void(const Result<Register>&)> done) = 0;
  /// Calls nobody any more.
  virtual void Stop() = 0;
};

}  // namespace pheromone::cluster
