// To which cluster the journal of a running server belongs, and what field time was by this
// machine's clock: the file of server/store/journal/membership.h.
//
//   MembershipKeeper keeper(is_member);
//   PHEROMONE_TRY_STATUS(keeper.Read(folder));
//   const uint64_t start_ms = keeper.StartMs(last_stamp, utc_ms, evaporates);
//   if (!keeper.IsClockNoted(field_ms, utc_ms)) { aside: keeper.NoteClock(field_ms, utc_ms); }
//
// After Read any thread; what changes the file waits for the disk.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "server/base/result.h"
#include "server/core/engine/event.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/membership.h"

namespace pheromone::daemon {

class MembershipKeeper {
 public:
  /// `is_member`: this server is of a cluster.
  explicit MembershipKeeper(bool is_member) : is_member_(is_member) {}

  /// Errors: as ReadMembership. The folder outlives this; without Read there is no journal.
  Status Read(journal::Folder* folder);

  /// An empty one if there is none.
  journal::Membership Get() const;
  /// Why a server must not go on from this journal, with the way out, if it is one of that cluster
  /// (empty: alone); empty: it may. `is_new`: the journal has no events.
  std::string WhyNotFor(const std::string& cluster, bool is_new) const;
  /// The field time to resume with, by this machine's clock.
  uint64_t StartMs(const engine::Stamp& last, int64_t utc_ms, bool evaporates_while_down) const;

  Status Note(const std::string& cluster, const std::string& id);
  /// The epoch that Membership::new_epoch asked for was begun. Errors are logged.
  void EndNewEpoch();
  /// Keeps what field time was by this machine's clock, if it is not as it was. Errors are logged
  /// once, until it succeeds again.
  bool IsClockNoted(uint64_t field_ms, int64_t utc_ms) const;
  void NoteClock(uint64_t field_ms, int64_t utc_ms);

 private:
  Status Change(const journal::Membership& membership);

  const bool is_member_;
  journal::Folder* folder_ = nullptr;
  mutable std::mutex mutex_;
  // Under mutex_:
  std::optional<journal::Membership> membership_;  // empty: there is no file
  bool has_reported_clock_ = false;
};

}  // namespace pheromone::daemon
