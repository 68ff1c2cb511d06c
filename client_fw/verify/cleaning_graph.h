// All states of a CleaningWorld and the steps between them, breadth first; and in this graph the
// longest that something can take.
//
//   CleaningGraph<2> graph(&world, {.symmetric = true});
//   graph.Explore({world.Start({5, 6})});
//   std::vector<uint32_t> cycle;
//   const std::vector<int> gaps = graph.LongestGaps(&cycle);
//
// For millions of states: see state_set.h for the memory; a step takes 5 bytes more.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/verify/cleaning_check.h"
#include "client_fw/verify/cleaning_key.h"
#include "client_fw/verify/cleaning_world.h"
#include "client_fw/verify/state_set.h"

namespace pheromone::verify {

struct GraphOptions {
  bool symmetric = false;
  uint8_t max_level = kFullLevel;  ///< a level above it is wrong
  uint8_t goal_level = 0;  ///< not 0: where all levels are below it, the search goes no further
  uint16_t horizon = 0;    ///< not 0: nor from this time on
  size_t max_states = 100'000'000;
};

struct LongestWay {
  int time = 0;
  /// Not empty: it can take for ever, by going through these states again and again.
  std::vector<uint32_t> cycle{};
};

template <size_t kWords>
class CleaningGraph {
 public:
  CleaningGraph(CleaningWorld* world, const GraphOptions& options)
      : world_(world), options_(options), keys_(*world, options.symmetric, options.horizon != 0) {}

  /// False if something is wrong: then `wrong` and `last` say what and where. Also false with an
  /// empty `wrong`: more than max_states.
  bool Explore(const std::vector<CleaningState>& starts) {
    for (const CleaningState& start : starts) {
      starts_.push_back(start);
      Add(0, start, nullptr);
    }
    bool gives_up = false;
    for (uint32_t from = 0; from < states_.size() && wrong_.empty(); ++from) {
      gives_up = gives_up || states_.size() > options_.max_states;
      first_step_.push_back(static_cast<uint32_t>(targets_.size()));
      if (gives_up) {
        continue;  // as an end
      }
      const CleaningState state = keys_.Unpack(states_[from]);
      if (IsEnd(state)) {
        continue;
      }
      world_->Next(state, &next_);
      if (next_.empty()) {
        Fail("nothing can happen any more", from);
      }
      for (const CleaningSuccessor& successor : next_) {
        Add(from, successor.state, &successor.step);
      }
    }
    first_step_.push_back(static_cast<uint32_t>(targets_.size()));
    return wrong_.empty() && !gives_up;
  }

  size_t size() const { return states_.size(); }
  size_t steps() const { return targets_.size(); }
  /// How many there are without taking directions on the grid for equal, if the starts are the same
  /// in all directions.
  size_t unfolded() const { return unfolded_; }
  const std::string& wrong() const { return wrong_; }
  uint32_t last() const { return last_; }

  /// By zone, the longest from the end of a cleaning until the begin of the next; 0 if it is
  /// closed. The cycle is that of the first zone that need never be cleaned again.
  std::vector<int> LongestGaps(std::vector<uint32_t>* cycle) {
    std::vector<int> gaps(world_->zones());
    values_.assign(states_.size() * lanes(), kUnknown);
    for (uint8_t zone = 0; zone < world_->zones(); ++zone) {
      if (world_->IsClosed(zone)) {
        continue;
      }
      if (lanes() == 1) {
        values_.assign(states_.size(), kUnknown);
      }
      for (uint32_t state = 0; state < states_.size(); ++state) {
        if ((keys_.Cleaned(states_[state]) >> zone & 1) != 0) {
          gaps[zone] = std::max(gaps[zone], LongestAfter(state, zone, cycle));
        }
        if (!cycle->empty()) {
          return gaps;
        }
      }
      // One that is not cleaned even once has no gap, but is forgotten too.
      for (uint32_t start = 0; start < starts_count_ && cycle->empty(); ++start) {
        LongestAfter(start, zone, cycle);
      }
      if (!cycle->empty()) {
        return gaps;
      }
    }
    for (size_t zone = 0; zone < world_->zones(); ++zone) {  // those of zones that are like it
      for (const ZoneMap& map : keys_.maps()) {
        gaps[map[zone]] = std::max(gaps[map[zone]], gaps[zone]);
      }
    }
    return gaps;
  }

  /// From the starts until a state from which the search went no further. A cycle is one even if
  /// there were more than max_states.
  LongestWay LongestUntilEnd() {
    values_.assign(states_.size(), kUnknown);
    LongestWay longest;
    for (uint32_t start = 0; start < starts_count_ && longest.cycle.empty(); ++start) {
      longest.time = std::max(longest.time, Longest(start, kNoZone, &longest.cycle));
    }
    return longest;
  }

  /// The shortest way to a state, then through others in turn.
  std::vector<CleaningMoment> TraceTo(uint32_t state, const std::vector<uint32_t>& then = {}) {
    std::vector<uint32_t> path = then;
    for (; state >= starts_count_; state = came_from_[state]) {
      path.insert(path.begin(), state);
    }
    std::vector<CleaningMoment> trace;
    for (const CleaningState& start : starts_) {
      if (trace.empty() && keys_.Pack(start).key == states_[state]) {
        trace.push_back({{}, start, 0});
      }
    }
    int time = 0;
    for (const uint32_t to : path) {  // with directions and robots as they were at the start
      world_->Next(trace.back().state, &next_);
      const auto found =
          std::find_if(next_.begin(), next_.end(), [&](const CleaningSuccessor& successor) {
            return keys_.Pack(successor.state).key == states_[to];
          });
      assert(found != next_.end());
      trace.push_back({found->step, found->state, time});
      time += found->step.passed;
    }
    return trace;
  }

 private:
  static constexpr uint16_t kUnknown = std::numeric_limits<uint16_t>::max();
  static constexpr uint16_t kOnTheWay = kUnknown - 1;
  static constexpr uint16_t kLongest = kOnTheWay - 1;  // this, or more
  static constexpr uint8_t kNoZone = 255;
  static constexpr uint8_t kPassedBits = 5;

  struct Frame {
    uint32_t state;
    uint32_t step;
    uint8_t zone;
    int longest;
  };

  size_t lanes() const { return keys_.maps().size() == 1 ? 1 : world_->zones(); }
  size_t PlaceOf(uint32_t state, uint8_t zone) const {
    return lanes() == 1 ? state : state * lanes() + zone;
  }

  bool IsEnd(const CleaningState& state) const {
    return (options_.horizon != 0 && state.clock >= options_.horizon) ||
           (options_.goal_level != 0 && HighestLevel(state) < options_.goal_level);
  }

  uint8_t HighestLevel(const CleaningState& state) const {
    return *std::max_element(state.level.begin(), state.level.end());
  }

  void Fail(std::string wrong, uint32_t state) {
    if (wrong_.empty()) {
      wrong_ = std::move(wrong);
      last_ = state;
    }
  }

  void Add(uint32_t from, const CleaningState& state, const CleaningStep* step) {
    const auto packed = keys_.Pack(state);
    const auto [number, is_new] = states_.Insert(packed.key);
    if (step != nullptr) {
      assert(step->passed >> kPassedBits == 0);
      targets_.push_back(number);
      infos_.push_back(static_cast<uint8_t>(step->passed | packed.way << kPassedBits));
    }
    if (!is_new) {
      return;
    }
    came_from_.push_back(from);
    starts_count_ += step == nullptr ? 1 : 0;
    unfolded_ += keys_.maps().size() / packed.equal;
    if (std::string wrong = world_->Wrong(state); !wrong.empty()) {
      Fail(std::move(wrong), number);
    } else if (const uint8_t level = HighestLevel(state);
               level > options_.max_level &&
               (options_.horizon == 0 || state.clock < options_.horizon)) {
      Fail("a zone is soiled to " + std::to_string(level * kLevelPercent) + " %", number);
    }
  }

  // From the end of the cleaning of a zone, if it may end in this state.
  int LongestAfter(uint32_t state, uint8_t zone, std::vector<uint32_t>* cycle) {
    int longest = 0;
    for (uint32_t step = first_step_[state]; step < first_step_[state + 1]; ++step) {
      const uint8_t after = keys_.maps()[infos_[step] >> kPassedBits][zone];
      if ((keys_.Cleaned(states_[targets_[step]]) >> after & 1) == 0 && cycle->empty()) {
        longest = std::max(longest, Longest(targets_[step], after, cycle) + PassedIn(step));
      }
    }
    return longest;
  }

  int PassedIn(uint32_t step) const { return infos_[step] & ((1 << kPassedBits) - 1); }

  // None if the step is the end: what passes after it does not count.
  int PassedBefore(uint32_t to, uint8_t zone, uint32_t step) const {
    return IsReached(to, zone) ? 0 : PassedIn(step);
  }

  bool IsReached(uint32_t state, uint8_t zone) const {
    return zone == kNoZone ? first_step_[state] == first_step_[state + 1]
                           : (keys_.Cleaned(states_[state]) >> zone & 1) != 0;
  }

  // The longest time from a state until the zone is cleaned, or without a zone until an end; if
  // there is none, a cycle.
  int Longest(uint32_t first, uint8_t first_zone, std::vector<uint32_t>* cycle) {
    const auto enter = [&](uint32_t state, uint8_t zone) {
      const uint32_t begin = first_step_[state];
      const bool is_end = IsReached(state, zone);
      values_[PlaceOf(state, zone)] = is_end ? uint16_t{0} : kOnTheWay;
      if (!is_end) {
        frames_.push_back({state, begin, zone, 0});
      }
    };
    if (values_[PlaceOf(first, first_zone)] == kUnknown) {
      enter(first, first_zone);
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
      const uint8_t info = infos_[frame.step];
      const uint8_t zone =
          frame.zone == kNoZone ? kNoZone : keys_.maps()[info >> kPassedBits][frame.zone];
      const uint16_t value = values_[PlaceOf(to, zone)];
      if (value == kUnknown) {
        enter(to, zone);
      } else if (value == kOnTheWay) {
        auto start = frames_.end() - 1;
        while (start->state != to || start->zone != zone) {
          --start;
        }
        for (; start != frames_.end(); ++start) {
          cycle->push_back(start->state);
        }
        frames_.clear();
        return 0;
      } else {
        frame.longest = std::max(frame.longest, value + PassedBefore(to, zone, frame.step));
        ++frame.step;
      }
    }
    return values_[PlaceOf(first, first_zone)];
  }

  CleaningWorld* world_;
  GraphOptions options_;
  CleaningKeys<kWords> keys_;
  StateSet<kWords> states_;
  std::vector<CleaningState> starts_;
  uint32_t starts_count_ = 0;  // they are the first states
  size_t unfolded_ = 0;
  Chunked<uint32_t> came_from_;
  // The steps from a state are those from first_step_[state] on.
  Chunked<uint32_t> first_step_;
  Chunked<uint32_t> targets_;
  Chunked<uint8_t> infos_;  // the time that passes, and the symmetry
  std::string wrong_;
  uint32_t last_ = 0;
  std::vector<CleaningSuccessor> next_;
  std::vector<uint16_t> values_;
  std::vector<Frame> frames_;
};

}  // namespace pheromone::verify
