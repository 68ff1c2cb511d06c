// Where robots may be at the start of a search: a zone for each, given or all that there are.
//
//   const CleaningStarts two = {{0, 7}, {3, 3}};
//   StartStates(&world, &two, /*soil_percent=*/20).Each([&](const CleaningState& start) { ... });
//
// One state after the other: six robots on 62 zones have 100 million starts. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "client_fw/verify/cleaning_world.h"

namespace pheromone::verify {

/// Robots' starts: a zone for each. Empty: all.
using CleaningStarts = std::vector<std::vector<uint8_t>>;

class StartStates {
 public:
  /// `world` and `starts` outlive this. Without a percentage soil is no part of the search; closed
  /// zones have none.
  StartStates(const CleaningWorld* world, const CleaningStarts* starts,
              std::optional<int> soil_percent = std::nullopt)
      : world_(world), starts_(starts), soil_percent_(soil_percent) {}

  int soil_percent() const { return soil_percent_.value_or(0); }

  /// Until `visit` returns false.
  void Each(const std::function<bool(const CleaningState&)>& visit) const;

 private:
  CleaningState StateOf(const std::vector<uint8_t>& start) const;

  const CleaningWorld* world_;
  const CleaningStarts* starts_;
  std::optional<int> soil_percent_;
};

}  // namespace pheromone::verify
