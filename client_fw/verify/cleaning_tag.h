// The tag of one zone, for a search through many states: written by the real code of
// server/core/tags, but told and set in the few numbers on which the robots' behaviour depends.
//
//   CleaningTag tag;
//   tag.Set(content);                         // as of some state
//   if (tag.Claim(robot, generation, lease))  // the real Write, on condition
//   const ZoneContent after = tag.Get();      // and back
//
// The sign "occupied" and the time of the last cleaning are facts (Tammet, Vain and Kuusik 2006,
// section 4.3). Times are the model's units, of which one is a second here. One object serves all
// tags in turn: nothing is allocated between Set and Get.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/core/tags/tag.h"

namespace pheromone::verify {

constexpr size_t kMaxCleaners = 6;  ///< robots: the leases that a tag of eight slots has room for
constexpr int kNoSign = -1;

/// What is on a tag.
struct ZoneContent {
  /// The rank of the last cleaning's time stamp among those of all zones; 0: never cleaned, or
  /// forgotten.
  int stamp = 0;
  /// By robot: kNoSign, 0 for a sign without a lease, or the time until its lease ends.
  std::array<int, kMaxCleaners> sign{kNoSign, kNoSign, kNoSign, kNoSign, kNoSign, kNoSign};
  bool operator==(const ZoneContent&) const = default;

  bool is_occupied() const;
};

class CleaningTag {
 public:
  CleaningTag();

  /// Forgets all, and sets it to this.
  void Set(const ZoneContent& content);
  ZoneContent Get() const;
  uint16_t generation() const { return tag_.generation(); }

  /// Writes "occupied" if nobody has written since `expected` was read, or without that condition.
  bool Claim(size_t robot, std::optional<uint16_t> expected, int lease);
  /// Writes when it was cleaned in place of the robot's sign, if that is still there.
  bool Stamp(size_t robot, int stamp);
  /// Lets time pass, and leases end.
  void Wait(int time);
  /// Eight passers-by write one block each, later than all that is there.
  void Crowd();

 private:
  tags::Tag tag_;
  uint64_t now_ms_ = 0;
  tags::Policy policy_;
};

}  // namespace pheromone::verify
