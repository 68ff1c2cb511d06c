// The log that daemons of a cluster share (server/cluster/replicated_log.h), as small as it can be:
// two changes under two comparisons, and pages that show any moment. Requests are executed at once
// and in any order; that they are late, doubled or lost is the network's (replica_world.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/base/bytes.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::verify {

/// What is left out, so that it is refuted.
enum class LogMutant : uint8_t {
  kNone,
  kNoPlaceCompare,    ///< a group replaces the one at its place
  kNoTermCompare,     ///< whoever led once may append
  kTellsLeaderFirst,  ///< a page has the present leader, but groups of an earlier moment only
};

class LogModel {
 public:
  explicit LogModel(LogMutant mutant) : mutant_(mutant) {}

  cluster::Leader TakeLead(cluster::Term seen, const std::string& node);
  cluster::Appended Append(const cluster::Group& group);
  /// Whether such a request can change the log, now or ever: terms only rise, and places are not
  /// emptied.
  bool CanTakeLead(cluster::Term seen) const { return seen == leader_.term; }
  bool CanAppend(const cluster::Group& group) const;

  /// The number of changes so far: a moment. Follow's page at moment `to`, after one at `from`, or
  /// 0, about what is not before `first`.
  size_t now() const { return changes_.size(); }
  cluster::Page PageOf(size_t from, size_t to, cluster::Sequence first) const;

  const cluster::Leader& leader() const { return leader_; }
  /// Who was granted a term; empty: nobody.
  std::string LeaderOf(cluster::Term term) const;
  /// In the order of their places.
  const std::vector<cluster::Group>& groups() const { return groups_; }
  cluster::Sequence end() const;

  void Encode(ByteWriter* writer) const;

 private:
  struct Change {
    std::optional<cluster::Leader> leader;  // or a group
    cluster::Group group;
  };

  const cluster::Group* At(cluster::Sequence place) const;

  LogMutant mutant_;
  std::vector<Change> changes_;
  cluster::Leader leader_;
  std::vector<cluster::Group> groups_;
};

}  // namespace pheromone::verify
