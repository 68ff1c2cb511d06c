#include "client_fw/verify/cleaning_world.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <optional>

#include "client_fw/core/tasks/cleaning.h"

namespace pheromone::verify {
namespace {

using client::CleaningAct;
using client::CleaningDecision;
using client::CleaningView;

constexpr int kNever = 1'000;
constexpr uint32_t kAfterAll = 1'000;  // later than all ranks

constexpr uint64_t Bit(size_t zone) {
  return uint64_t{1} << zone;
}

}  // namespace

CleaningWorld::CleaningWorld(const CleaningLimits& limits)
    : limits_(limits),
      zones_(0),
      robots_(static_cast<size_t>(limits.robots)),
      neighbours_(limits.Floor()) {
  assert(WhatIsWrong(limits).empty());
  zones_ = neighbours_.size();
  for (size_t zone = 0; zone < zones_; ++zone) {
    in_sight_[zone] = Bit(zone);
    for (const uint8_t beside : neighbours_[zone]) {
      in_sight_[zone] |= Bit(beside);
    }
  }
  compared_ = ComparedZones(in_sight_);
}

CleaningState CleaningWorld::Start(const std::vector<uint8_t>& robots_in) const {
  assert(robots_in.size() == robots_);
  CleaningState state;
  state.asks_left = static_cast<uint8_t>(limits_.asks);
  for (size_t robot = 0; robot < robots_; ++robot) {
    state.cleaners[robot].phase = CleanerPhase::kDeciding;
    state.cleaners[robot].zone = robots_in[robot];
  }
  return state;
}

void CleaningWorld::EachStart(const std::function<bool(const std::vector<uint8_t>&)>& visit) const {
  std::vector<uint8_t> start(robots_);
  while (true) {
    if (std::none_of(start.begin(), start.end(), [&](uint8_t zone) { return IsClosed(zone); }) &&
        !visit(start)) {
      return;
    }
    size_t robot = robots_;
    while (robot > 0 && start[robot - 1] + 1u == zones_) {
      --robot;
    }
    if (robot == 0) {
      return;
    }
    std::fill(start.begin() + static_cast<ptrdiff_t>(robot - 1), start.end(),
              static_cast<uint8_t>(start[robot - 1] + 1));
  }
}

void CleaningWorld::Next(const CleaningState& state, std::vector<CleaningSuccessor>* next) {
  Next(state, limits_.reduced ? ToExplore(state) : AllDue(state), next);
}

void CleaningWorld::NextInAllOrders(const CleaningState& state,
                                    std::vector<CleaningSuccessor>* next) {
  Next(state, AllDue(state), next);
}

void CleaningWorld::Next(const CleaningState& state, const Due& due,
                         std::vector<CleaningSuccessor>* next) {
  next->clear();
  from_ = &state;
  next_ = next;
  for (size_t robot = 0; robot < robots_; ++robot) {
    const Cleaner& it = state.cleaners[robot];
    if ((due.robots >> robot & 1) == 0) {
      continue;
    }
    if (it.phase == CleanerPhase::kDeciding) {
      Decide(state, robot);
      Break(state, robot);
    } else if (it.phase == CleanerPhase::kClaiming) {
      Claim(state, robot);
    } else {
      Finish(state, robot);
    }
  }
  if (due.soil) {
    SoilAll(state);
  }
  if (limits_.passers_by) {
    Crowd(state);
  }
  if (state.asks_left > 0) {
    AskFor(state);
  }
}

CleaningWorld::Due CleaningWorld::AllDue(const CleaningState& state) const {
  Due due{.soil = state.tick == 0};
  for (size_t robot = 0; robot < robots_; ++robot) {
    due.robots |= (IsDue(state, robot) ? 1u : 0u) << robot;
  }
  return due;
}

// A persistent set (Godefroid 1996, chapter 4): what is not in it can be done afterwards as well,
// with the same outcome. Until time passes a robot reads the tags in sight of its zone and writes
// on that of its own; so robots that are out of each other's sight cannot notice who was first. As
// all of them take time for whatever they do next, no other becomes due before.
//
// Soil that comes before robots claim makes no zone cleaner than soil that comes after, and no
// decision depends on it: when none has just cleaned, it is first. After a cleaning it makes a
// difference: then the zone soils at once, or not before the next step.
CleaningWorld::Due CleaningWorld::ToExplore(const CleaningState& state) const {
  const Due due = AllDue(state);
  if (limits_.passers_by || state.asks_left > 0) {
    return due;
  }
  bool finishes = false;
  for (size_t robot = 0; robot < robots_; ++robot) {
    finishes = finishes || ((due.robots >> robot & 1) != 0 && state.cleaners[robot].is_cleaning());
  }
  if (due.soil) {
    return finishes ? due : Due{.soil = true};
  }
  for (size_t robot = 0; robot < robots_; ++robot) {
    if ((due.robots >> robot & 1) != 0 && IsAlone(state, robot, due.robots)) {
      return {.robots = 1u << robot};
    }
  }
  return due;
}

// Out of sight of all others that are due.
bool CleaningWorld::IsAlone(const CleaningState& state, size_t robot, uint32_t due) const {
  const size_t zone = state.cleaners[robot].zone;
  for (size_t other = 0; other < robots_; ++other) {
    const size_t there = state.cleaners[other].zone;
    if (other != robot && (due >> other & 1) != 0 &&
        ((in_sight_[zone] >> there & 1) != 0 || (in_sight_[there] >> zone & 1) != 0)) {
      return false;
    }
  }
  return true;
}

void CleaningWorld::Decide(const CleaningState& state, size_t robot) {
  const uint8_t zone = state.cleaners[robot].zone;
  CleaningView view{};
  const auto see = [&](size_t seen) {
    const bool is_wanted = (state.wanted >> seen & 1) != 0;
    view.tags[view.count++] = {.is_occupied = IsOccupied(state, seen),
                               .is_closed = IsClosed(seen),
                               .cleaned_s = state.rank[seen] + 1u,
                               .wanted_s = is_wanted ? kAfterAll : 0u};
  };
  see(zone);
  for (const uint8_t beside : neighbours_[zone]) {
    see(beside);
  }
  const CleaningDecision first = client::Decide(view, 0);
  const auto move = [&](CleaningDecision decision) {
    for (uint8_t pick = 0; pick < decision.choices; ++pick) {
      const uint8_t tag = client::Decide(view, pick).tag;
      Move(state, robot, neighbours_[zone][tag - 1u]);
    }
  };
  switch (first.act) {
    case CleaningAct::kWait: {
      CleaningState after = state;
      after.cleaners[robot].timer = static_cast<uint8_t>(limits_.wait);
      Visit(CleaningAction::kWaits, robot, zone, after);
      break;
    }
    case CleaningAct::kMove:
      move(first);
      break;
    case CleaningAct::kClean: {
      CleaningState after = state;
      // It claims in a later step: others may act between reading a tag and writing on it.
      after.cleaners[robot] = {.phase = CleanerPhase::kClaiming, .zone = zone};
      Visit(CleaningAction::kDecidesToClean, robot, zone, after);
      if (limits_.moves_between_equals) {  // as if its own zone were not there
        view.tags[0].is_occupied = true;
        const CleaningDecision other = client::Decide(view, 0);
        if (other.act == CleaningAct::kMove &&
            view.tags[other.tag].cleaned_s == view.tags[0].cleaned_s) {
          move(other);
        }
      }
      break;
    }
  }
}

void CleaningWorld::Move(CleaningState state, size_t robot, uint8_t zone) {
  for (int time = limits_.move_min; time <= limits_.move_max; ++time) {
    state.cleaners[robot].zone = zone;
    state.cleaners[robot].timer = static_cast<uint8_t>(time);
    Visit(CleaningAction::kMoves, robot, zone, state);
  }
}

void CleaningWorld::Claim(CleaningState state, size_t robot) {
  Cleaner& it = state.cleaners[robot];
  const size_t zone = it.zone;
  tag_.Set(ContentOf(state, zone));
  const uint16_t before = tag_.generation();
  std::optional<uint16_t> expected;
  if (!limits_.claims_unconditionally) {
    expected = static_cast<uint16_t>(before - (it.is_stale ? 1 : 0));
  }
  const bool is_done = tag_.Claim(robot, expected, limits_.lease);
  const ZoneContent content = tag_.Get();
  for (Cleaner& other : state.cleaners) {
    if (other.phase == CleanerPhase::kClaiming && other.zone == zone) {
      other.is_stale = other.is_stale || tag_.generation() != before;
    }
  }
  it = {.phase = CleanerPhase::kDeciding, .zone = it.zone};
  if (!is_done) {
    Visit(CleaningAction::kIsRefused, robot, zone, state);
    return;
  }
  it.phase = CleanerPhase::kCleaning;
  for (int time = limits_.clean_min; time <= limits_.clean_max; ++time) {
    it.timer = static_cast<uint8_t>(time);
    CleaningState after = state;
    SetContent(&after, zone, content);
    Visit(CleaningAction::kClaims, robot, zone, after);
  }
  // When it breaks down makes no difference to others: the lease began with the claim.
  if (MayBreak(state)) {
    it.phase = CleanerPhase::kBroken;
    it.timer = static_cast<uint8_t>(limits_.lease);
    SetContent(&state, zone, content);
    Visit(CleaningAction::kBreaksDown, robot, zone, state);
  }
}

void CleaningWorld::Finish(CleaningState state, size_t robot) {
  const size_t zone = state.cleaners[robot].zone;
  const uint8_t newest = *std::max_element(state.rank.begin(), state.rank.end());
  tag_.Set(ContentOf(state, zone));
  const uint16_t before = tag_.generation();
  const bool is_stamped =
      tag_.Stamp(robot, newest + (state.is_newest_now ? 0 : 1) + StampOfRankZero());
  SetContent(&state, zone, tag_.Get());
  for (Cleaner& other : state.cleaners) {
    if (other.phase == CleanerPhase::kClaiming && other.zone == zone) {
      other.is_stale = other.is_stale || tag_.generation() != before;
    }
  }
  if (is_stamped) {
    state.level[zone] = 0;
    state.is_newest_now = true;
    if (!limits_.asks_for_ever) {
      state.wanted &= ~Bit(zone);
    }
  }
  state.cleaners[robot] = {.phase = CleanerPhase::kDeciding, .zone = static_cast<uint8_t>(zone)};
  Visit(is_stamped ? CleaningAction::kFinishes : CleaningAction::kIsRefused, robot, zone, state);
}

// The robot is gone; it has no sign.
void CleaningWorld::Break(CleaningState state, size_t robot) {
  if (MayBreak(state)) {
    const uint8_t zone = state.cleaners[robot].zone;
    state.cleaners[robot] = {};
    Visit(CleaningAction::kBreaksDown, robot, zone, state);
  }
}

// A zone's level stays while it is cleaned: it decreases in some way that is not modelled, from an
// upper bound.
void CleaningWorld::SoilAll(CleaningState state) {
  for (size_t zone = 0; zone < zones_; ++zone) {
    const bool is_cleaned =
        std::any_of(state.cleaners.begin(), state.cleaners.end(),
                    [&](const Cleaner& it) { return it.is_cleaning() && it.zone == zone; });
    if (!is_cleaned) {
      state.level[zone] = Soiled(zone, state.level[zone]);
    }
  }
  state.tick = static_cast<uint8_t>(limits_.soiling_step);
  Visit(CleaningAction::kSoils, 0, 0, state);
}

// What they write is gone before the next writing there: it makes no difference to the signs.
void CleaningWorld::Crowd(const CleaningState& state) {
  for (size_t zone = 0; zone < zones_; ++zone) {
    const ZoneContent content = ContentOf(state, zone);
    if (!content.is_occupied()) {
      continue;
    }
    tag_.Set(content);
    tag_.Crowd();
    CleaningState after = state;
    SetContent(&after, zone, tag_.Get());
    Visit(CleaningAction::kCrowds, 0, zone, after);
  }
}

void CleaningWorld::AskFor(const CleaningState& state) {
  for (size_t zone = 0; zone < zones_; ++zone) {
    CleaningState after = state;
    after.wanted |= Bit(zone);
    --after.asks_left;
    Visit(CleaningAction::kAsks, 0, zone, after);
  }
}

bool CleaningWorld::IsDue(const CleaningState& state, size_t robot) const {
  const Cleaner& it = state.cleaners[robot];
  return it.timer == 0 && it.phase <= CleanerPhase::kCleaning;
}

bool CleaningWorld::MayBreak(const CleaningState& state) const {
  int broken = 0;
  for (size_t robot = 0; robot < robots_; ++robot) {
    broken += state.cleaners[robot].phase >= CleanerPhase::kBroken ? 1 : 0;
  }
  return broken < limits_.crashes;
}

// Of a robot's sign. How long it has been cleaning is not in the state if it may take different
// times: then this is the least.
int CleaningWorld::LeaseLeft(const Cleaner& cleaner) const {
  if (limits_.lease == 0) {
    return 0;
  }
  return cleaner.is_cleaning() ? limits_.lease - limits_.clean_max + cleaner.timer : cleaner.timer;
}

bool CleaningWorld::IsOccupied(const CleaningState& state, size_t zone) const {
  return std::any_of(state.cleaners.begin(), state.cleaners.end(),
                     [&](const Cleaner& it) { return it.has_sign && it.zone == zone; });
}

ZoneContent CleaningWorld::ContentOf(const CleaningState& state, size_t zone) const {
  ZoneContent content;
  content.stamp = state.rank[zone] + StampOfRankZero();
  for (size_t robot = 0; robot < robots_; ++robot) {
    const Cleaner& it = state.cleaners[robot];
    if (it.has_sign && it.zone == zone) {
      content.sign[robot] = LeaseLeft(it);
    }
  }
  return content;
}

void CleaningWorld::SetContent(CleaningState* state, size_t zone,
                               const ZoneContent& content) const {
  state->rank[zone] = static_cast<uint8_t>(content.stamp - StampOfRankZero());
  for (size_t robot = 0; robot < robots_; ++robot) {
    Cleaner& it = state->cleaners[robot];
    if (it.zone == zone) {
      it.has_sign = content.sign[robot] != kNoSign;
      if (it.phase == CleanerPhase::kBroken && !it.has_sign) {
        it = {};
      }
    }
  }
}

int CleaningWorld::TimeToNext(const CleaningState& state) const {
  int time = state.tick == kNoSoiling ? kNever : state.tick;
  for (size_t robot = 0; robot < robots_; ++robot) {
    const Cleaner& it = state.cleaners[robot];
    if (it.phase <= CleanerPhase::kCleaning) {
      time = std::min<int>(time, it.timer);
    }
    if (it.has_sign && limits_.lease > 0) {
      time = std::min(time, LeaseLeft(it));
    }
  }
  return time;
}

// Lets time pass until something is due. Leases end on the way. Returns how much it was.
uint8_t CleaningWorld::Advance(CleaningState* state) {
  int passed = 0;
  while (true) {
    const int time = TimeToNext(*state);
    if (time == 0 || time == kNever) {
      break;
    }
    passed += time;
    state->is_newest_now = false;
    for (size_t robot = 0; robot < robots_; ++robot) {
      Cleaner& it = state->cleaners[robot];
      if (it.has_sign && limits_.lease > 0 && LeaseLeft(it) == time) {
        const uint8_t zone = it.zone;
        tag_.Set(ContentOf(*state, zone));
        tag_.Wait(time);
        SetContent(state, zone, tag_.Get());
      }
    }
    for (size_t robot = 0; robot < robots_; ++robot) {
      Cleaner& it = state->cleaners[robot];
      it.timer = static_cast<uint8_t>(std::max(it.timer - time, 0));
    }
    if (state->tick != kNoSoiling) {
      state->tick = static_cast<uint8_t>(state->tick - time);
    }
  }
  state->clock = static_cast<uint16_t>(state->clock + passed);
  return static_cast<uint8_t>(passed);
}

void CleaningWorld::Visit(CleaningAction action, size_t robot, size_t zone, CleaningState state) {
  const uint8_t passed = Advance(&state);
  Tidy(&state);
  next_->push_back(
      {{action, static_cast<uint8_t>(robot), static_cast<uint8_t>(zone), passed}, state});
}

void CleaningWorld::Tidy(CleaningState* state) const {
  const auto occupied_by = [](const Cleaner& it) {
    return it.has_sign || it.is_cleaning() ? Bit(it.zone) : 0;
  };
  uint64_t occupied = 0;
  uint64_t occupied_before = 0;
  bool may_stamp_now = false;
  for (size_t robot = 0; robot < robots_; ++robot) {
    const Cleaner& it = state->cleaners[robot];
    occupied |= occupied_by(it);
    occupied_before |= occupied_by(from_->cleaners[robot]);
    may_stamp_now = may_stamp_now || (it.is_cleaning() && it.timer == 0);
  }
  // Most steps change nothing of what ranks depend on.
  if (state->rank == from_->rank && occupied == occupied_before &&
      state->is_newest_now == from_->is_newest_now && (may_stamp_now || !state->is_newest_now)) {
    return;
  }
  uint64_t used = limits_.passers_by ? 1 : 0;
  uint8_t newest = 0;
  for (size_t zone = 0; zone < zones_; ++zone) {
    newest = std::max(newest, state->rank[zone]);
    // Nobody looks at the time stamp of an occupied zone before it is written again.
    if (!ForgetsOccupied() || (occupied >> zone & 1) == 0) {
      used |= Bit(state->rank[zone]);
    }
  }
  state->is_newest_now = state->is_newest_now && may_stamp_now && (used >> newest & 1) != 0;
  for (size_t zone = 0; zone < zones_; ++zone) {
    uint8_t& rank = state->rank[zone];
    rank = ForgetsOccupied() && (occupied >> zone & 1) != 0
               ? 0
               : static_cast<uint8_t>(std::popcount(used & (Bit(rank) - 1)));
  }
  if (limits_.reduced && !limits_.passers_by) {
    RankBySight(compared_, all_zones() & ~(ForgetsOccupied() ? occupied : 0), state->is_newest_now,
                &state->rank);
  }
}

std::string CleaningWorld::Wrong(const CleaningState& state) const {
  uint64_t cleaned = 0;
  for (size_t robot = 0; robot < robots_; ++robot) {
    const Cleaner& it = state.cleaners[robot];
    if (it.phase != CleanerPhase::kGone && IsClosed(it.zone)) {
      return "a robot is in zone " + std::to_string(it.zone + 1) + ", which is closed";
    }
    if (it.is_cleaning()) {
      if ((cleaned >> it.zone & 1) != 0) {
        return "two robots clean zone " + std::to_string(it.zone + 1);
      }
      cleaned |= Bit(it.zone);
    }
  }
  return "";
}

}  // namespace pheromone::verify
