#include "server/daemon/membership_keeper.h"

#include <spdlog/spdlog.h>

#include <cstdlib>

#include "server/core/engine/service/field_clock.h"

namespace pheromone::daemon {
namespace {

constexpr int64_t kClockSlackMs = 1'000;  // that a note of the clock may be off

}  // namespace

Status MembershipKeeper::Read(journal::Folder* folder) {
  folder_ = folder;
  PHEROMONE_TRY(membership_, journal::ReadMembership(*folder));
  return Ok();
}

journal::Membership MembershipKeeper::Get() const {
  const std::lock_guard lock(mutex_);
  return membership_.value_or(journal::Membership());
}

std::string MembershipKeeper::WhyNotFor(const std::string& cluster, bool is_new) const {
  const journal::Membership its = Get();
  if (its.cluster == cluster || (its.cluster.empty() && is_new)) {
    return "";
  }
  const std::string& folder = folder_->path();
  if (cluster.empty()) {
    return fmt::format(
        "{} is the journal of a server of cluster \"{}\", expected a configuration with [cluster]; "
        "to go on alone with this map, in a new epoch: pheromonectl cluster leave --new-epoch {}",
        folder, its.cluster, folder);
  }
  return fmt::format(
      "{} has a map that is {}, expected one of cluster \"{}\" or an empty folder; to join it, "
      "move the folder away; to begin the cluster anew with this map, pheromonectl cluster reset "
      "--name {} {}",
      folder, its.cluster.empty() ? "of no cluster" : fmt::format("of cluster \"{}\"", its.cluster),
      cluster, cluster, folder);
}

// A cluster's events may have the UTC of another machine, which is not to be compared with this
// one's.
uint64_t MembershipKeeper::StartMs(const engine::Stamp& last, int64_t utc_ms,
                                   bool evaporates_while_down) const {
  const std::lock_guard lock(mutex_);
  if (!membership_) {
    return is_member_ ? last.field_time_ms
                      : engine::FieldClock::ResumeAt(last, utc_ms, evaporates_while_down);
  }
  const engine::Stamp own{last.field_time_ms, membership_->field_less_utc_ms
                                                  ? static_cast<int64_t>(last.field_time_ms) -
                                                        *membership_->field_less_utc_ms
                                                  : utc_ms};
  return engine::FieldClock::ResumeAt(own, utc_ms, evaporates_while_down);
}

// Under the mutex.
Status MembershipKeeper::Change(const journal::Membership& membership) {
  PHEROMONE_TRY_STATUS(journal::WriteMembership(membership, folder_));
  membership_ = membership;
  return Ok();
}

Status MembershipKeeper::Note(const std::string& cluster, const std::string& id) {
  const std::lock_guard lock(mutex_);
  journal::Membership its = membership_.value_or(journal::Membership());
  its.cluster = cluster;
  its.id = id;
  its.founds = false;
  return Change(its);
}

void MembershipKeeper::EndNewEpoch() {
  const std::lock_guard lock(mutex_);
  Status ended = Ok();
  if (is_member_) {
    journal::Membership its = *membership_;
    its.new_epoch = false;
    ended = Change(its);
  } else {
    ended = journal::RemoveMembership(folder_);
    membership_.reset();
  }
  if (!ended.ok()) {
    spdlog::error("journal: the next start begins an epoch again: {}", ended.error());
  }
}

bool MembershipKeeper::IsClockNoted(uint64_t field_ms, int64_t utc_ms) const {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || !membership_) {
    return true;  // it is being written, which may take long; or there is nothing to add it to
  }
  const int64_t now = static_cast<int64_t>(field_ms) - utc_ms;
  return membership_->field_less_utc_ms &&
         std::abs(now - *membership_->field_less_utc_ms) < kClockSlackMs;
}

void MembershipKeeper::NoteClock(uint64_t field_ms, int64_t utc_ms) {
  const std::lock_guard lock(mutex_);
  journal::Membership its = *membership_;
  its.field_less_utc_ms = static_cast<int64_t>(field_ms) - utc_ms;
  const Status noted = Change(its);
  if (!noted.ok() && !has_reported_clock_) {
    spdlog::error("journal: {}", noted.error());
  }
  has_reported_clock_ = !noted.ok();
}

}  // namespace pheromone::daemon
