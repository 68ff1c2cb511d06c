// What a scenario makes happen at its times: walls open, food moves, robots fail.
//
//   ScenarioEvents events(scenario, world.get());
//   while (...) {
//     PHEROMONE_TRY_STATUS(events.MakeDue());   // then Sense
//     PHEROMONE_TRY_STATUS(world->Step());
//   }
//
// Whenever something moved, the shortest ways between food and nests are worked out anew. One
// thread; scenario and world outlive it.
#pragma once

#include <cstddef>
#include <vector>

#include "client_fw/lab/behaviour_abi.h"
#include "client_fw/lab/scenario/scenario.h"
#include "client_fw/lab/world.h"
#include "server/base/result.h"

namespace pheromone::lab {

class ScenarioEvents {
 public:
  ScenarioEvents(const LabScenario& scenario, World* world);

  /// Those that are due, before the world senses.
  Status MakeDue();

 private:
  Status Make(const LabEvent& event);
  void FailSome(const LabEvent& event);
  void SetLeastWays();
  double LeastWayM(const PheromoneSite& from, const PheromoneSite& to) const;

  const LabScenario& scenario_;
  World* world_;
  std::vector<Gate> gates_;
  size_t next_ = 0;
};

}  // namespace pheromone::lab
