// Cleaning robots on a floor of zones, one step at a time: the real decision of client_fw/core, and
// claims, signs and time stamps on the real tags (Tammet, Vain and Kuusik 2006, section 4).
//
//   CleaningWorld world({.columns = 4, .rows = 3, .robots = 2, .clean_min = 5, .clean_max = 5});
//   std::vector<CleaningSuccessor> next;
//   world.Next(world.Start({5, 6}), &next);  // all that may happen next
//
// A robot sees its own zone and those beside it (the paper's figure 1). It decides, goes to a zone
// and decides there again, or claims its own, cleans it, and writes the time in place of its sign.
// What is due at the same time happens in any order. Time passes when nothing is due, so that each
// state has something due; it is in the paper's units.
//
// The paper leaves open how long cleaning, moving and waiting take, what happens between equal time
// stamps and where robots start: CleaningLimits say it, or all possibilities are explored.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client_fw/verify/cleaning_limits.h"
#include "client_fw/verify/cleaning_stamps.h"
#include "client_fw/verify/cleaning_tag.h"

namespace pheromone::verify {

constexpr uint8_t kNoSoiling = 255;

enum class CleanerPhase : uint8_t {
  kDeciding,  ///< in `timer`, when it has arrived or waited
  kClaiming,  ///< has read its zone's tag, and is about to write
  kCleaning,  ///< until `timer` is over
  kBroken,    ///< its sign stays until the lease ends, in `timer`
  kGone,
};

struct Cleaner {
  CleanerPhase phase = CleanerPhase::kGone;
  uint8_t zone = 0;
  uint8_t timer = 0;
  bool is_stale = false;  ///< the tag that it read was written to since
  bool has_sign = false;  ///< "occupied" is on its zone's tag
  bool operator==(const Cleaner&) const = default;

  /// Whether it is in the zone with its brushes turning.
  bool is_cleaning() const { return phase == CleanerPhase::kCleaning; }
};

struct CleaningState {
  StampRanks rank{};
  std::array<uint8_t, kMaxZones> level{};  ///< of soil in %, if it is explored
  std::array<Cleaner, kMaxCleaners> cleaners{};
  bool is_newest_now = false;  ///< the newest time stamp is the present time
  uint8_t tick = kNoSoiling;   ///< time until zones become dirtier
  uint16_t clock = 0;          ///< time since the start
  uint64_t wanted = 0;         ///< zones that are to be cleaned again, and were not yet; as bits
  uint8_t asks_left = 0;
};

enum class CleaningAction : uint8_t {
  kWaits,
  kMoves,
  kDecidesToClean,
  kClaims,
  kIsRefused,
  kFinishes,
  kBreaksDown,
  kSoils,
  kCrowds,
  kAsks,
};

struct CleaningStep {
  CleaningAction action = CleaningAction::kWaits;
  uint8_t robot = 0;
  uint8_t zone = 0;    ///< where it acts or goes to
  uint8_t passed = 0;  ///< time from then until something is due again
};

struct CleaningSuccessor {
  CleaningStep step;
  CleaningState state;
};

class CleaningWorld {
 public:
  /// Asserts that nothing is wrong with the limits.
  explicit CleaningWorld(const CleaningLimits& limits);

  const CleaningLimits& limits() const { return limits_; }
  uint8_t zones() const { return static_cast<uint8_t>(zones_); }
  uint64_t all_zones() const { return (uint64_t{1} << zones_) - 1; }  ///< as bits
  const std::vector<uint8_t>& neighbours(size_t zone) const { return neighbours_[zone]; }

  /// Robots about to decide in these zones, all zones cleaned at the same time.
  CleaningState Start(const std::vector<uint8_t>& robots_in) const;
  /// All unordered choices of zones to start in, but for closed ones, one after the other, until
  /// `visit` returns false.
  void EachStart(const std::function<bool(const std::vector<uint8_t>&)>& visit) const;

  /// Zones become no dirtier than this: for a search to which all that is more is the same.
  void LimitSoil(int full_percent) { full_percent_ = full_percent; }
  /// What a zone's level becomes in a step.
  uint8_t Soiled(size_t zone, uint8_t level) const {
    return static_cast<uint8_t>(std::min(level + RateOf(zone), full_percent_));
  }

  /// What may happen after a state of Start or of Next. `next` is emptied first; once it has grown
  /// to its size, nothing is allocated.
  void Next(const CleaningState& state, std::vector<CleaningSuccessor>* next);
  /// The same, in all orders whatever the limits say: which of them are left out depends on the
  /// order of the robots.
  void NextInAllOrders(const CleaningState& state, std::vector<CleaningSuccessor>* next);

  /// A closed zone does not count: it stays clean.
  int RateOf(size_t zone) const {
    return limits_.rates_percent.empty() || IsClosed(zone) ? 0 : limits_.rates_percent[zone];
  }
  bool IsClosed(size_t zone) const { return (limits_.closed >> zone & 1) != 0; }

  /// Empty, or what is wrong: two robots that clean one zone, or one in a closed zone.
  std::string Wrong(const CleaningState& state) const;

 private:
  void Decide(const CleaningState& state, size_t robot);
  void Claim(CleaningState state, size_t robot);
  void Finish(CleaningState state, size_t robot);
  void SoilAll(CleaningState state);
  void Crowd(const CleaningState& state);
  void AskFor(const CleaningState& state);
  void Break(CleaningState state, size_t robot);
  void Move(CleaningState state, size_t robot, uint8_t zone);

  struct Due {
    uint32_t robots = 0;  // as bits
    bool soil = false;
  };
  void Next(const CleaningState& state, const Due& due, std::vector<CleaningSuccessor>* next);
  Due AllDue(const CleaningState& state) const;
  Due ToExplore(const CleaningState& state) const;
  bool IsAlone(const CleaningState& state, size_t robot, uint32_t due) const;
  bool IsDue(const CleaningState& state, size_t robot) const;
  bool MayBreak(const CleaningState& state) const;
  bool ForgetsOccupied() const { return limits_.crashes == 0 && !limits_.passers_by; }
  /// Passers-by can make a tag forget when its zone was cleaned: rank 0 is kept for that.
  int StampOfRankZero() const { return limits_.passers_by ? 0 : 1; }
  int LeaseLeft(const Cleaner& cleaner) const;
  bool IsOccupied(const CleaningState& state, size_t zone) const;
  ZoneContent ContentOf(const CleaningState& state, size_t zone) const;
  void SetContent(CleaningState* state, size_t zone, const ZoneContent& content) const;
  uint8_t Advance(CleaningState* state);
  int TimeToNext(const CleaningState& state) const;
  void Visit(CleaningAction action, size_t robot, size_t zone, CleaningState state);
  // Numbers ranks from 0 again, and forgets what no longer matters.
  void Tidy(CleaningState* state) const;

  CleaningLimits limits_;
  size_t zones_;
  size_t robots_;
  CleaningNeighbours neighbours_;
  ZoneSets in_sight_{};  // itself and those beside it
  ZoneSets compared_{};
  int full_percent_ = kFullPercent;
  CleaningTag tag_;
  // Of the current Next.
  const CleaningState* from_ = nullptr;
  std::vector<CleaningSuccessor>* next_ = nullptr;
};

}  // namespace pheromone::verify
