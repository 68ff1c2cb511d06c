// Level "radio" of the lab: its scenario with each byte on the air, by the simulator of `run`.
//
//   const Result<lab::LabResult> result = RunLabOnAir(scenario, {});    // scenario.level is kRadio
//
// The channels are those of a scenario without [radio]: 9600 baud, 2 ms of turnaround, carrier
// detect. Robots of the lab's scenario stand where they would there. One thread.
#pragma once

#include <cstdint>
#include <functional>

#include "client_fw/lab/scenario/run.h"
#include "client_fw/lab/scenario/scenario.h"
#include "client_fw/swarm/recorder.h"
#include "client_fw/swarm/scenario/scenario.h"

namespace pheromone::swarm {

/// Requires level "radio", at which the lab accepts what the simulator knows.
Scenario OnAir(const lab::LabScenario& scenario);

/// Answers, stops and distances from paths in a record of OnAir(scenario).
lab::LabResult MeasuredOnAir(const lab::LabScenario& scenario, const SwarmRecord& record);

/// Both. `progress` is told the time once a second; it may be empty.
lab::LabResult RunLabOnAir(const lab::LabScenario& scenario,
                           const std::function<void(int64_t ms)>& progress);

}  // namespace pheromone::swarm
