// What the robots of a group do: from what they sense to wheel speeds and deposits. The structs of
// behaviour_abi.h have what is seen and done; behaviours/ has those that are built in, plugin.h
// loads others.
#pragma once

#include <cstddef>

#include "client_fw/lab/behaviour_abi.h"
#include "server/base/result.h"

namespace pheromone::lab {

class Behaviour {
 public:
  Behaviour() = default;
  Behaviour(const Behaviour&) = delete;
  Behaviour& operator=(const Behaviour&) = delete;
  virtual ~Behaviour() = default;

  /// Decides for the robots `first` to `first + count - 1` of its group. Several threads call at
  /// once, for different robots. An error ends the run.
  virtual Status Act(const PheromoneView& view, const PheromoneActions& actions, size_t first,
                     size_t count) = 0;
};

}  // namespace pheromone::lab
