#include "client_fw/verify/cleaning_graph.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace pheromone::verify {
namespace {

constexpr uint32_t kReportEvery = 1u << 14;  // looks at the limits, to tell of progress

}  // namespace

CleaningGraph::CleaningGraph(CleaningWorld* world, const GraphOptions& options,
                             const StartStates& starts)
    : world_(world),
      options_(options),
      starts_(starts),
      keys_(*world, options.key, starts.soil_percent()),
      states_(keys_.words()),
      moment_(*world, options.key, starts.soil_percent()) {}

bool CleaningGraph::Explore() {
  starts_.Each([&](const CleaningState& start) {
    Add(0, start, nullptr);
    return GoesOn(0);
  });
  for (uint32_t from = 0; from < states_.size() && wrong_.empty(); ++from) {
    if (options_.has_longest) {
      first_step_.push_back(static_cast<uint32_t>(targets_.size()));
    } else if (gave_up_) {
      break;
    }
    if (gave_up_) {
      continue;  // as an end
    }
    const CleaningState state = keys_.Unpack(states_[from]);
    if (!IsEnd(state)) {
      Expand(from, state);
    }
  }
  first_step_.push_back(static_cast<uint32_t>(targets_.size()));
  return wrong_.empty() && !gave_up_;
}

// Looked at before each step: what comes of one is at most some ten thousand states, of six robots
// that may each take many different times.
bool CleaningGraph::GoesOn(uint32_t explored) {
  const SearchLimits& limits = options_.limits;
  constexpr size_t kMaxSteps = StateSet::kMaxStates - 100'000;
  const size_t now = bytes();
  gave_up_ = states_.size() > std::min(limits.max_states, kMaxSteps) ||
             targets_.size() > kMaxSteps || now > limits.max_bytes ||
             (++looks_ % kReportEvery == 0 && limits.progress &&
              !limits.progress({explored, states_.size(), now}));
  return !gave_up_;
}

size_t CleaningGraph::bytes() const {
  return states_.bytes() + came_from_.bytes() + first_step_.bytes() + targets_.bytes() +
         infos_.bytes() + moment_.bytes() + outcomes_.bytes() +
         next_.capacity() * sizeof(CleaningSuccessor) +
         (options_.has_longest ? states_.size() * lanes() * sizeof(uint16_t) : 0);
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

// Adds what may come of a state: its successors, or, reduced, what may come of its moment.
void CleaningGraph::Expand(uint32_t from, const CleaningState& first) {
  outcomes_.Clear();
  moment_.Begin(first);
  for (CleaningState state; moment_.Take(&state) && GoesOn(from);) {
    world_->Next(state, &next_);
    if (next_.empty()) {
      Fail("nothing can happen any more", from);
    }
    for (const CleaningSuccessor& next : next_) {
      const bool is_on_the_way = world_->limits().reduced && next.step.passed == 0 &&
                                 !IsEnd(next.state) &&
                                 WhatIsWrongIn(next.state, next.state.clock).empty();
      if (is_on_the_way) {
        moment_.Add(next.state);
      } else {
        Add(from, next.state, &next.step);
      }
    }
  }
}

void CleaningGraph::Add(uint32_t from, const CleaningState& state, const CleaningStep* step) {
  const CleaningKeys::Packed packed = keys_.Pack(state);
  const auto [number, is_new] = states_.Insert(packed.key.data());
  if (step != nullptr) {
    AddStep(number, static_cast<uint16_t>(step->passed | packed.way << kWayShift));
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

void CleaningGraph::AddStep(uint32_t to, uint16_t info) {
  if (world_->limits().reduced) {  // in another order to the same
    const uint64_t outcome = uint64_t{to} << 32 | info;
    if (!outcomes_.Insert(&outcome).second) {
      return;
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
  starts_.Each([&](const CleaningState& start) {
    if (IsState(start, state)) {
      trace.push_back({{}, start, 0});
    }
    return trace.empty();
  });
  int time = 0;
  std::vector<CleaningSuccessor> way;
  for (const uint32_t to : path) {  // with directions and robots as they were at the start
    way.clear();
    moment_.Begin(trace.back().state);
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
    if (IsState(next.state, to) || (world_->limits().reduced && next.step.passed == 0 &&
                                    moment_.Add(next.state) && FindWay(next.state, to, way))) {
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
