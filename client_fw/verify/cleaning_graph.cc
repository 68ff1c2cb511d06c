#include "client_fw/verify/cleaning_graph.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace pheromone::verify {
namespace {

constexpr uint32_t kLookEvery = 1u << 14;  // states, at limits and progress

}  // namespace

CleaningGraph::CleaningGraph(CleaningWorld* world, const GraphOptions& options,
                             std::vector<CleaningState> starts)
    : world_(world),
      options_(options),
      starts_(std::move(starts)),
      keys_(*world, options.key, starts_),
      states_(keys_.words()) {}

bool CleaningGraph::Explore() {
  for (const CleaningState& start : starts_) {
    Add(0, start, nullptr);
  }
  bool gives_up = false;
  for (uint32_t from = 0; from < states_.size() && wrong_.empty(); ++from) {
    gives_up = gives_up || !GoesOn(from);
    if (options_.has_longest) {
      first_step_.push_back(static_cast<uint32_t>(targets_.size()));
    } else if (gives_up) {
      break;
    }
    if (gives_up) {
      continue;  // as an end
    }
    const CleaningState state = keys_.Unpack(states_[from]);
    if (IsEnd(state)) {
      continue;
    }
    if (!Expand(state)) {
      Fail("nothing can happen any more", from);
    }
    for (const CleaningSuccessor& outcome : outcomes_) {
      Add(from, outcome.state, &outcome.step);
    }
  }
  first_step_.push_back(static_cast<uint32_t>(targets_.size()));
  return wrong_.empty() && !gives_up;
}

bool CleaningGraph::GoesOn(uint32_t explored) const {
  const SearchLimits& limits = options_.limits;
  // A state has a handful of successors at most, which are numbered before the next look.
  constexpr size_t kMaxSteps = StateSet::kMaxStates - 1'000;
  if (states_.size() > std::min(limits.max_states, kMaxSteps) || targets_.size() > kMaxSteps) {
    return false;
  }
  if (explored % kLookEvery != 0) {
    return true;
  }
  const size_t now = bytes();
  return now <= limits.max_bytes &&
         (!limits.progress || limits.progress({explored, states_.size(), now}));
}

size_t CleaningGraph::bytes() const {
  return states_.bytes() + came_from_.bytes() + first_step_.bytes() + targets_.bytes() +
         infos_.bytes() + (options_.has_longest ? states_.size() * lanes() * sizeof(uint16_t) : 0);
}

bool CleaningGraph::IsEnd(const CleaningState& state) const {
  if (options_.horizon != 0 && state.clock >= options_.horizon) {
    return true;
  }
  return options_.goal_percent != 0 &&
         std::all_of(state.level.begin(), state.level.begin() + world_->zones(),
                     [&](uint8_t level) { return level < options_.goal_percent; });
}

void CleaningGraph::Fail(std::string wrong, uint32_t state) {
  if (wrong_.empty()) {
    wrong_ = std::move(wrong);
    last_ = state;
  }
}

bool CleaningGraph::IsTooDirty(const CleaningState& state, int time, size_t zone) const {
  return options_.below_percent != 0 && (options_.key.leveled >> zone & 1) != 0 &&
         state.level[zone] >= options_.below_percent &&
         (options_.horizon == 0 || time < options_.horizon);
}

std::string CleaningGraph::WhatIsWrongIn(const CleaningState& state, int time) const {
  std::string wrong = world_->Wrong(state);
  for (size_t zone = 0; zone < world_->zones() && wrong.empty(); ++zone) {
    if (IsTooDirty(state, time, zone)) {
      wrong = "zone " + std::to_string(zone + 1) + " is soiled to " +
              std::to_string(state.level[zone]) + " %";
    }
  }
  return wrong;
}

// What may come of a state, in outcomes_: its successors, or, reduced, what may come of its moment.
// False if there is a state after which nothing can happen.
bool CleaningGraph::Expand(const CleaningState& state) {
  outcomes_.clear();
  moment_.assign(1, state);
  while (!moment_.empty()) {
    const CleaningState from = moment_.back();
    moment_.pop_back();
    world_->Next(from, &next_);
    if (next_.empty()) {
      return false;
    }
    for (const CleaningSuccessor& next : next_) {
      const bool is_on_the_way = world_->limits().reduced && next.step.passed == 0 &&
                                 !IsEnd(next.state) &&
                                 WhatIsWrongIn(next.state, next.state.clock).empty();
      if (is_on_the_way) {
        moment_.push_back(next.state);
      } else {
        outcomes_.push_back(next);
      }
    }
  }
  return true;
}

void CleaningGraph::Add(uint32_t from, const CleaningState& state, const CleaningStep* step) {
  const CleaningKeys::Packed packed = keys_.Pack(state);
  const auto [number, is_new] = states_.Insert(packed.key.data());
  if (step != nullptr) {
    AddStep(from, number, static_cast<uint16_t>(step->passed | packed.way << kWayShift));
  }
  if (!is_new) {
    return;
  }
  came_from_.push_back(from);
  starts_count_ += step == nullptr ? 1 : 0;
  unfolded_ += keys_.maps().size() / packed.equal;
  const int time = state.clock - (step != nullptr ? step->passed : 0);
  if (std::string wrong = WhatIsWrongIn(state, time); !wrong.empty()) {
    Fail(std::move(wrong), number);
  }
}

void CleaningGraph::AddStep(uint32_t from, uint32_t to, uint16_t info) {
  if (options_.has_longest && world_->limits().reduced) {  // in another order to the same
    for (size_t step = first_step_[from]; step < targets_.size(); ++step) {
      if (targets_[step] == to && infos_[step] == info) {
        return;
      }
    }
  }
  ++steps_;
  if (options_.has_longest) {
    targets_.push_back(to);
    infos_.push_back(info);
  }
}

std::vector<int> CleaningGraph::LongestGaps(uint64_t zones, std::vector<int>* first,
                                            std::vector<uint32_t>* cycle) {
  std::vector<int> gaps(world_->zones());
  first->assign(world_->zones(), 0);
  values_.assign(states_.size() * lanes(), kUnknown);
  for (uint8_t zone = 0; zone < world_->zones(); ++zone) {
    if ((zones >> zone & 1) == 0) {
      continue;
    }
    if (lanes() == 1) {
      values_.assign(states_.size(), kUnknown);
    }
    for (uint32_t state = 0; state < states_.size() && cycle->empty(); ++state) {
      if (IsCleaned(state, zone)) {
        gaps[zone] = std::max(gaps[zone], LongestAfter(state, zone, cycle));
      }
    }
    // One that is not cleaned even once has no gap, but is forgotten too.
    for (uint32_t start = 0; start < starts_count_ && cycle->empty(); ++start) {
      (*first)[zone] = std::max((*first)[zone], Longest(start, zone, cycle));
    }
    if (!cycle->empty()) {
      return gaps;
    }
  }
  for (size_t zone = 0; zone < world_->zones(); ++zone) {  // those of zones that are like it
    for (const ZoneMap& map : keys_.maps()) {
      gaps[map[zone]] = std::max(gaps[map[zone]], gaps[zone]);
      (*first)[map[zone]] = std::max((*first)[map[zone]], (*first)[zone]);
    }
  }
  return gaps;
}

LongestWay CleaningGraph::LongestUntilEnd() {
  values_.assign(states_.size(), kUnknown);
  LongestWay longest;
  for (uint32_t start = 0; start < starts_count_ && longest.cycle.empty(); ++start) {
    longest.time = std::max(longest.time, Longest(start, kNoZone, &longest.cycle));
  }
  return longest;
}

bool CleaningGraph::IsState(const CleaningState& state, uint32_t number) const {
  const CleaningKeys::Packed packed = keys_.Pack(state);
  return std::equal(packed.key.begin(), packed.key.begin() + static_cast<ptrdiff_t>(keys_.words()),
                    states_[number]);
}

std::vector<CleaningMoment> CleaningGraph::TraceTo(uint32_t state,
                                                   const std::vector<uint32_t>& then) {
  std::vector<uint32_t> path = then;
  for (; state >= starts_count_; state = came_from_[state]) {
    path.insert(path.begin(), state);
  }
  std::vector<CleaningMoment> trace;
  for (const CleaningState& start : starts_) {
    if (trace.empty() && IsState(start, state)) {
      trace.push_back({{}, start, 0});
    }
  }
  int time = 0;
  std::vector<CleaningSuccessor> way;
  for (const uint32_t to : path) {  // with directions and robots as they were at the start
    way.clear();
    const bool is_found = FindWay(trace.back().state, to, &way);
    assert(is_found);
    static_cast<void>(is_found);
    for (const CleaningSuccessor& step : way) {
      trace.push_back({step.step, step.state, time});
      time += step.step.passed;
    }
  }
  return trace;
}

// The steps to a state that is the next in the graph: one, or, reduced, those of a moment.
bool CleaningGraph::FindWay(const CleaningState& from, uint32_t to,
                            std::vector<CleaningSuccessor>* way) {
  std::vector<CleaningSuccessor> all;
  world_->NextInAllOrders(from, &all);
  for (const CleaningSuccessor& next : all) {
    way->push_back(next);
    if (IsState(next.state, to) ||
        (world_->limits().reduced && next.step.passed == 0 && FindWay(next.state, to, way))) {
      return true;
    }
    way->pop_back();
  }
  return false;
}

// From the end of the cleaning of a zone, if it may end in this state.
int CleaningGraph::LongestAfter(uint32_t state, uint8_t zone, std::vector<uint32_t>* cycle) {
  int longest = 0;
  for (uint32_t step = first_step_[state]; step < first_step_[state + 1]; ++step) {
    const uint8_t after = MapOf(step)[zone];
    if (!IsCleaned(targets_[step], after) && cycle->empty()) {
      longest = std::max(longest, Longest(targets_[step], after, cycle) + PassedIn(step));
    }
  }
  return longest;
}

// None if the step is the end: what passes after it does not count.
int CleaningGraph::PassedBefore(uint32_t to, uint8_t zone, uint32_t step) const {
  return IsReached(to, zone) ? 0 : PassedIn(step);
}

bool CleaningGraph::IsReached(uint32_t state, uint8_t zone) const {
  return zone == kNoZone ? first_step_[state] == first_step_[state + 1] : IsCleaned(state, zone);
}

void CleaningGraph::Enter(uint32_t state, uint8_t zone) {
  const bool is_end = IsReached(state, zone);
  values_[PlaceOf(state, zone)] = is_end ? uint16_t{0} : kOnTheWay;
  if (!is_end) {
    frames_.push_back({state, first_step_[state], zone, 0});
  }
}

// The frames from that of a state on.
void CleaningGraph::NoteCycle(uint32_t to, uint8_t zone, std::vector<uint32_t>* cycle) {
  auto start = frames_.end() - 1;
  while (start->state != to || start->zone != zone) {
    --start;
  }
  for (; start != frames_.end(); ++start) {
    cycle->push_back(start->state);
  }
  frames_.clear();
}

// The longest from a state until the zone is cleaned, or without a zone until an end; if there is
// none, a cycle.
int CleaningGraph::Longest(uint32_t first, uint8_t first_zone, std::vector<uint32_t>* cycle) {
  if (values_[PlaceOf(first, first_zone)] == kUnknown) {
    Enter(first, first_zone);
  }
  while (!frames_.empty()) {
    Frame& frame = frames_.back();
    if (frame.step == first_step_[frame.state + 1]) {
      values_[PlaceOf(frame.state, frame.zone)] =
          static_cast<uint16_t>(std::min<int>(frame.longest, kLongest));
      frames_.pop_back();
      continue;
    }
    const uint32_t to = targets_[frame.step];
    const uint8_t zone = frame.zone == kNoZone ? kNoZone : MapOf(frame.step)[frame.zone];
    const uint16_t value = values_[PlaceOf(to, zone)];
    if (value == kUnknown) {
      Enter(to, zone);
    } else if (value == kOnTheWay) {
      NoteCycle(to, zone, cycle);
      return 0;
    } else {
      frame.longest = std::max(frame.longest, value + PassedBefore(to, zone, frame.step));
      ++frame.step;
    }
  }
  return values_[PlaceOf(first, first_zone)];
}

}  // namespace pheromone::verify
