// A world that Python steps: a scenario, the actions of the groups that Python drives, and the
// order in which all of it happens.
//
//   Simulation simulation(text, "ants.toml", folder, {{"run.seed", "3"}}, {"ants"}, /*threads=*/2);
//   simulation.Step();      // act; then the events that are due, and what is sensed next
//
// What was sensed is always that of the present step, so whoever looks between two steps has what
// it needs to decide.
//
// Threads: one at a time, and a Turn tells. What is wrong is thrown as a LabError, for pybind11.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "client_fw/lab/scenario/events.h"
#include "client_fw/lab/scenario/run.h"
#include "client_fw/lab/scenario/scenario.h"
#include "client_fw/lab/world.h"
#include "server/base/result.h"

namespace pheromone::lab::python {

class LabError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Simulation {
 public:
  /// `drive`: the groups that Python decides for, by name, whatever the scenario says.
  Simulation(std::string_view text, const std::string& name,
             const std::optional<std::filesystem::path>& folder, const KeyValues& settings,
             const std::vector<std::string>& drive, int threads);

  const LabScenario& scenario() const { return *scenario_; }
  World& world() { return *world_; }
  const World& world() const { return *world_; }

  struct GroupPlace {
    size_t first = 0;
    size_t count = 0;
    bool driven = false;
  };
  const std::vector<GroupPlace>& places() const { return places_; }

  /// An action that is refused changes nothing, and the actions of the driven groups are then as
  /// before any was given. Any other error ends the world.
  void Step();

  /// Stand still, deposit nothing, keep the load, sense everything.
  void ResetActions(size_t group);

  /// What `pheromone-swarm lab run` would have said of the scenario: nothing before its end.
  const std::optional<LabResult>& result() const { return result_; }

  /// Of the moment.
  LabResult Measured() const;

  /// Whoever looks at the world or changes it has a turn; two at once, or after an error that ended
  /// the world, is an error. The lock of Python's interpreter guards it.
  class Turn {
   public:
    explicit Turn(Simulation* simulation);
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    ~Turn() { simulation_->busy_ = false; }

   private:
    Simulation* simulation_;
  };

 private:
  void ResetAll();
  void Sense();

  std::unique_ptr<const LabScenario> scenario_;
  std::unique_ptr<World> world_;
  std::unique_ptr<ScenarioEvents> events_;
  std::vector<GroupPlace> places_;
  std::optional<LabResult> result_;
  bool busy_ = false;
  std::string ended_;  // by this error
};

}  // namespace pheromone::lab::python
