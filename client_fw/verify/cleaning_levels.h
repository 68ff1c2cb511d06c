// How dirty zones can become until a horizon: a search through all states of a CleaningWorld, from
// moment to moment.
//
//   const StartStates starts(&world, &zones, /*soil_percent=*/20);
//   LevelSearch search(&world, {.below = 51, .horizon = 240}, starts, {});
//   if (!search.Run()) ...                     // search.wrong() says what happens when
//   search.highest()[4];                       // of zone 5, in %
//
// Robots decide by time stamps, never by soil. So states that differ in levels alone are one, with
// the highest level of each zone that any way there leaves: zones soil by themselves, and the more
// the more they had, so that each of these levels, and what follows from it, is one that the zone
// can truly have, though not all zones at once. For "all zones are below a level at all times" this
// is exact; for "all are below at the same time" it would not be.
//
// A state is kept until all steps of its moment are done; what happens within a moment is kept only
// as long. Memory is that of the states in the time that the longest step takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client_fw/verify/cleaning_graph.h"
#include "client_fw/verify/cleaning_key.h"
#include "client_fw/verify/cleaning_moment.h"
#include "client_fw/verify/cleaning_starts.h"
#include "client_fw/verify/cleaning_world.h"
#include "client_fw/verify/state_set.h"

namespace pheromone::verify {

struct LevelBounds {
  int below = 0;         ///< %: a level that is not below is wrong
  uint16_t horizon = 0;  ///< the last moment is before it
};

class LevelSearch {
 public:
  /// `world`, and what `starts` need, outlive the search.
  LevelSearch(CleaningWorld* world, const LevelBounds& bounds, const StartStates& starts,
              const SearchLimits& limits);

  /// False if something is wrong, or with an empty `wrong` beyond the limits.
  bool Run();

  const std::string& wrong() const { return wrong_; }
  int wrong_time() const { return wrong_time_; }                ///< the first one
  size_t wrong_zone() const { return wrong_zone_; }             ///< whose level is
  const std::vector<int>& highest() const { return highest_; }  ///< by zone, in %
  size_t states() const { return states_; }                     ///< of all moments
  size_t steps() const { return steps_; }
  size_t bytes() const { return max_bytes_; }  ///< at most, at a time

 private:
  // The states of a moment, with as many levels for each as there are zones.
  struct Layer {
    explicit Layer(size_t words) : states(words) {}
    StateSet states;
    std::vector<uint8_t> levels{};

    size_t bytes() const { return states.bytes() + levels.capacity(); }
  };

  bool GoesOn();
  void Keep(const CleaningState& state);
  bool Explore(const CleaningState& first);
  bool IsGood(int time, const CleaningSuccessor& next);
  bool CheckLevels(const CleaningState& state);

  CleaningWorld* world_;
  LevelBounds bounds_;
  StartStates starts_;
  SearchLimits limits_;
  CleaningKeys keys_;
  MomentStates moment_;               // with levels
  std::map<uint16_t, Layer> layers_;  // by their time
  size_t layer_bytes_ = 0;            // of the one that is being explored
  std::vector<CleaningSuccessor> next_;
  std::string wrong_;
  int wrong_time_ = 0;
  size_t wrong_zone_ = 0;
  std::vector<int> highest_;
  size_t states_ = 0;
  size_t steps_ = 0;
  size_t explored_ = 0;
  size_t unchecked_ = 0;  // steps since the last look at limits
  size_t max_bytes_ = 0;
};

}  // namespace pheromone::verify
