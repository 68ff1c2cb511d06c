// When a snapshot is due because replaying the log would take long: the log may be short and its
// events large (an operator's brush), or be about what changes by itself (a pheromone that
// diffuses).
//
//   SnapshotPace pace(settings.snapshot_cost, cost_since_snapshot);   // as Recover has counted it
//   pace.Add(engine.cost());                  // after each event
//   if (pace.IsDue(now_us)) pace.Begin(now_us), ...copy the state..., pace.End(now_us, true);
//   if (pace.IsBehind()) ...let operators wait...
//
// A recovery loads a snapshot and replays what came after its Begin. A snapshot costs as much as
// the map is large, so after each one there is a rest of as long as it took: at most half of the
// time goes into snapshots, on any map and disk. Whoever changes the map much faster than that is
// slowed down (IsBehind), so that a replay costs little more than kBehind times `due_cost`.
//
// Pure; one thread at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

namespace pheromone::journal {

class SnapshotPace {
 public:
  static constexpr uint64_t kRest = 1;
  static constexpr uint64_t kBehind = 4;
  static constexpr uint64_t kAfterFailureUs = 10'000'000;  ///< such as a full disk: the least rest

  SnapshotPace(uint64_t due_cost, uint64_t cost) : due_cost_(due_cost), cost_(cost) {}

  void Add(uint64_t cost) { cost_ += cost; }
  /// Of the events since the last snapshot that was made.
  uint64_t cost() const { return cost_ + before_; }
  /// Whether operators have to wait for the next snapshot.
  bool IsBehind() const { return cost() >= kBehind * due_cost_; }
  bool IsDue(uint64_t now_us) const {
    return !is_making_ && cost_ >= due_cost_ && now_us >= not_before_us_;
  }
  /// Before the state is frozen, for whatever reason.
  void Begin(uint64_t now_us) {
    is_making_ = true;
    begun_us_ = now_us;
    before_ += std::exchange(cost_, 0);
  }
  void End(uint64_t now_us, bool is_made) {
    is_making_ = false;
    const uint64_t rest_us = kRest * (now_us - begun_us_);
    not_before_us_ = now_us + (is_made ? rest_us : std::max(rest_us, kAfterFailureUs));
    cost_ += is_made ? 0 : before_;
    before_ = 0;
  }

 private:
  uint64_t due_cost_;
  uint64_t cost_;
  uint64_t before_ = 0;  // of the events before the snapshot that is being made
  bool is_making_ = false;
  uint64_t begun_us_ = 0;
  uint64_t not_before_us_ = 0;
};

}  // namespace pheromone::journal
