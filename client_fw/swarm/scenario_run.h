// Runs a scenario in virtual time and keeps what happened.
//
//   const ScenarioResult result = RunScenario(scenario, [](int64_t ms) { ... });
//
// Same scenario, same bytes. One thread.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/scenario.h"
#include "client_fw/swarm/track.h"

namespace pheromone::swarm {

/// An answer that a robot got.
struct Exchange {
  int64_t time_ms = 0;
  size_t robot = 0;       ///< counted from 0
  uint32_t requests = 0;  ///< sent since the answer before
  int16_t p_left = 0;     ///< 1/4096 of a pheromone unit
  int16_t p_right = 0;
};

struct RobotResult {
  std::vector<Sample> track;
  client::Counters counters{};
  double progress_m = 0;           ///< along the first [[path]]; 0 without one
  double mean_error_m = 0;         ///< from it
  int64_t off_limits_samples = 0;  ///< of the track: in an obstacle or off the map
};

struct ChannelResult {
  sim::RadioCounters radio;
  double utilisation = 0;
  uint64_t late_answers = 0;
};

struct ScenarioResult {
  std::vector<RobotResult> robots;
  std::vector<ChannelResult> channels;
  std::vector<Exchange> exchanges;  ///< in the order of time
  uint64_t state_hash = 0;          ///< of the engine, at the end
};

/// `show` is called with the virtual time at each sample; it may be empty.
ScenarioResult RunScenario(const Scenario& scenario, const std::function<void(int64_t ms)>& show);

}  // namespace pheromone::swarm
