// What the robots of a group do: from what they sense to wheel speeds and deposits. The structs of
// behaviour_abi.h have what is seen and done; behaviours/ has those that are built in, plugin.h
// loads others.
#pragma once

#include <cstddef>
#include <cstdint>

#include "client_fw/lab/behaviour_abi.h"
#include "server/base/result.h"
#include "server/core/field/field.h"

namespace pheromone::lab {

/// What robots that are answered by something of their own have had in a step.
struct StepOutcome {
  uint64_t answers = 0;
  uint64_t fail_safe_stops = 0;
  uint64_t deposited_quanta = 0;
  uint64_t refused_deposits = 0;
  bool map_full = false;  ///< which ends the run
};

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

  /// Called by one thread when all robots of a step have acted, while they move. An error ends the
  /// run.
  virtual Result<StepOutcome> EndStep(uint64_t /*now_ms*/) { return StepOutcome{}; }
  /// That its robots sense and lay trails on, if it is not the world's own.
  virtual const field::Field* field() const { return nullptr; }
  /// Of what it has besides the robots' arrays, to tell two runs apart.
  virtual uint64_t Hash() const { return 0; }
};

}  // namespace pheromone::lab
