// The events of a leader on their way into the log, in groups: one group at a time, at its place
// until the log has it.
//
//   queue.Begin(term, 1201);
//   queue.Push(1201, record);
//   if (const Group* group = queue.Due(now_ms)) log->Append(*group, ...)
//   queue.Commit();          // the group is in the log
//   queue.Repeat(now_ms);    // no answer: the same group is due again, in a while
//
// A group in flight is never changed, divided or moved, whatever comes meanwhile: if an earlier
// copy of it is in the log or still on its way there, the log takes the repetition for the same.
//
// No I/O, no clock. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "server/base/bytes.h"
#include "server/cluster/replica_settings.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

class GroupQueue {
 public:
  explicit GroupQueue(const ReplicaSettings& settings)
      : group_ms_(settings.group_ms),
        group_bytes_(settings.group_bytes),
        pause_ms_(settings.heartbeat_ms) {}

  /// A term in which this daemon leads begins. The queue is empty.
  void Begin(Term term, Sequence next);
  /// The next event. Records are joined as they are, so each must tell where it ends.
  void Push(Sequence sequence, std::string record);

  /// The group to append now, in flight from now on; nullptr. Valid until the next call.
  const Group* Due(uint64_t now_ms);
  void Repeat(uint64_t now_ms);
  /// Removes the group in flight.
  Group Commit();

  const std::optional<Group>& in_flight() const { return in_flight_; }
  /// Since when; kNever: none is.
  uint64_t in_flight_since_ms() const { return in_flight_ ? begun_ms_ : kNever; }
  /// No event is uncommitted.
  bool empty() const { return !in_flight_ && records_.empty(); }
  /// When a group is due: 0 if at once, kNever.
  uint64_t Deadline() const;
  void Encode(ByteWriter* writer) const;

 private:
  uint64_t group_ms_;
  size_t group_bytes_;
  uint64_t pause_ms_;

  Term term_ = 0;
  Sequence next_ = 1;                // of the next group
  std::deque<std::string> records_;  // not in a group yet
  std::optional<Group> in_flight_;
  bool is_appended_ = false;  // the group in flight was handed out and need not be again, as yet
  uint64_t begun_ms_ = 0;
  uint64_t due_ms_ = 0;  // not before
};

}  // namespace pheromone::cluster
