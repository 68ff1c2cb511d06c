// All states of a CleaningWorld and the steps between them, breadth first; and in this graph the
// longest that something can take.
//
//   const CleaningStarts starts = {{5, 6}};
//   CleaningGraph graph(&world, {}, StartStates(&world, &starts));
//   if (graph.Explore()) {
//     std::vector<uint32_t> cycle;  // and `first`
//     const std::vector<int> gaps = graph.LongestGaps(zones, &first, &cycle);
//
// If the world's limits are `reduced`, only the states are kept from which time has passed, and not
// those on the way through a moment, unless they are what is looked for.
//
// For millions of states: see state_set.h for the memory; a step takes 6 bytes more. What happens
// within a moment counts, too, as long as it is being explored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "client_fw/verify/cleaning_key.h"
#include "client_fw/verify/cleaning_moment.h"
#include "client_fw/verify/cleaning_starts.h"
#include "client_fw/verify/cleaning_trace.h"
#include "client_fw/verify/cleaning_world.h"
#include "client_fw/verify/state_set.h"

namespace pheromone::verify {

/// How far a search has come.
struct SearchProgress {
  size_t explored = 0;  ///< of the states known so far
  size_t states = 0;
  size_t bytes = 0;
};

/// Where a search ends without a verdict.
struct SearchLimits {
  size_t max_states = 100'000'000;
  size_t max_bytes = std::numeric_limits<size_t>::max();
  /// If given, called now and then; false ends the search.
  std::function<bool(const SearchProgress&)> progress{};
};

struct GraphOptions {
  KeyParts key;
  int below_percent = 0;    ///< not 0: a level that is not below it is wrong
  int goal_percent = 0;     ///< not 0: where all levels are below it, the search goes no further
  uint16_t horizon = 0;     ///< not 0: nor from this time on
  bool has_longest = true;  ///< Longest... may be called: steps are kept
  SearchLimits limits{};
};

struct LongestWay {
  int time = 0;
  /// Not empty: it can take for ever, by going through these states again and again.
  std::vector<uint32_t> cycle{};
};

class CleaningGraph {
 public:
  /// `world`, and what `starts` need, outlive the graph.
  CleaningGraph(CleaningWorld* world, const GraphOptions& options, const StartStates& starts);

  /// False if something is wrong: then `wrong` and `last` say what and where. Also false with an
  /// empty `wrong`: beyond the limits.
  bool Explore();

  size_t size() const { return states_.size(); }
  size_t steps() const { return steps_; }
  bool is_symmetric() const { return keys_.maps().size() > 1; }
  size_t bytes() const;
  /// How many there are without taking directions on the floor for equal, if the starts are the
  /// same in all directions.
  size_t unfolded() const { return unfolded_; }
  const std::string& wrong() const { return wrong_; }
  uint32_t last() const { return last_; }

  /// By zone, the longest from the end of a cleaning until the begin of the next, and in `first`
  /// from a start until the begin of the first; of zones that are not among `zones`, bits, 0. The
  /// cycle is that of the first zone that need never be cleaned again.
  std::vector<int> LongestGaps(uint64_t zones, std::vector<int>* first,
                               std::vector<uint32_t>* cycle);

  /// From the starts until a state from which the search went no further. A cycle is one even if
  /// the limits were reached.
  LongestWay LongestUntilEnd();

  /// The shortest way to a state, then through others in turn.
  std::vector<CleaningMoment> TraceTo(uint32_t state, const std::vector<uint32_t>& then = {});

 private:
  static constexpr uint16_t kUnknown = std::numeric_limits<uint16_t>::max();
  static constexpr uint16_t kOnTheWay = kUnknown - 1;
  static constexpr uint16_t kLongest = kOnTheWay - 1;  // this, or more
  static constexpr uint8_t kNoZone = 255;
  static constexpr uint8_t kWayShift = 8;  // of a step's information: the time that passes is below

  struct Frame {
    uint32_t state;
    uint32_t step;
    uint8_t zone;
    int longest;
  };

  size_t lanes() const { return keys_.maps().size() == 1 ? 1 : world_->zones(); }
  size_t PlaceOf(uint32_t state, uint8_t zone) const {
    return lanes() == 1 || zone == kNoZone ? state : state * lanes() + zone;
  }
  const ZoneMap& MapOf(uint32_t step) const { return keys_.maps()[infos_[step] >> kWayShift]; }
  bool IsCleaned(uint32_t state, uint8_t zone) const {
    return (keys_.Cleaned(states_[state]) >> zone & 1) != 0;
  }

  bool GoesOn(uint32_t explored);
  bool IsEnd(const CleaningState& state) const;
  void Fail(std::string wrong, uint32_t state);
  bool IsTooDirty(const CleaningState& state, int time, size_t zone) const;
  std::string WhatIsWrongIn(const CleaningState& state, int time) const;
  void Expand(uint32_t from, const CleaningState& first);
  void Add(uint32_t from, const CleaningState& state, const CleaningStep* step);
  void AddStep(uint32_t to, uint16_t info);
  bool FindWay(const CleaningState& from, uint32_t to, std::vector<CleaningSuccessor>* way);
  bool IsState(const CleaningState& state, uint32_t number) const;
  int LongestAfter(uint32_t state, uint8_t zone, std::vector<uint32_t>* cycle);
  int PassedIn(uint32_t step) const { return infos_[step] & ((1 << kWayShift) - 1); }
  int PassedBefore(uint32_t to, uint8_t zone, uint32_t step) const;
  bool IsReached(uint32_t state, uint8_t zone) const;
  int Longest(uint32_t first, uint8_t first_zone, std::vector<uint32_t>* cycle);
  void Enter(uint32_t state, uint8_t zone);
  void NoteCycle(uint32_t to, uint8_t zone, std::vector<uint32_t>* cycle);

  CleaningWorld* world_;
  GraphOptions options_;
  StartStates starts_;
  CleaningKeys keys_;
  StateSet states_;
  bool gave_up_ = false;
  size_t looks_ = 0;
  uint32_t starts_count_ = 0;  // they are the first states
  size_t unfolded_ = 0;
  size_t steps_ = 0;
  Chunked<uint32_t> came_from_;
  // The steps from a state are those from first_step_[state] on.
  Chunked<uint32_t> first_step_;
  Chunked<uint32_t> targets_;
  Chunked<uint16_t> infos_;
  std::string wrong_;
  uint32_t last_ = 0;
  std::vector<CleaningSuccessor> next_;
  MomentStates moment_;        // of Expand and FindWay
  SmallStateSet outcomes_{1};  // of Expand: targets and infos of its steps
  std::vector<uint16_t> values_;
  std::vector<Frame> frames_;
};

}  // namespace pheromone::verify
