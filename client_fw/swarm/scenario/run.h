// Runs a scenario and records it: against an engine in process and in virtual time, or against a
// running daemon in real time.
//
//   const SwarmRecord record = RunScenario(scenario, [](int64_t ms) { ... });
//
// One thread. Throws std::runtime_error if an AVR's image cannot be run or fails.
#pragma once

#include <csignal>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client_fw/swarm/live.h"
#include "client_fw/swarm/recorder.h"
#include "client_fw/swarm/scenario/scenario.h"
#include "server/base/result.h"

namespace pheromone::swarm {

/// In virtual time: same scenario, same bytes. `show` is called with the time at each sample; it
/// may be empty.
SwarmRecord RunScenario(const Scenario& scenario, const std::function<void(int64_t ms)>& show);

/// What the robots know about the links of a daemon.
enum class LinkKind : uint8_t {
  kBuffered,      ///< an answer may be late: who missed it resynchronises, and nobody takes turns
  kMediumAccess,  ///< medium_access = true: a late answer is not sent, and the server grants turns
};

/// In real time; `show` is called at each sample. Port i leads to the daemon's link for channel i,
/// whose map and pheromones are to be the scenario's. Ends after the scenario's duration, or soon
/// after `*stop` is not 0 (a signal handler's doing). Errors: the number of ports is not that of
/// channels, or a port cannot be opened. `keys_file` has the keys with which robots sign; empty:
/// they do not. Errors with it: those of keys::TakeKeys.
Result<SwarmRecord> RunScenarioLive(const Scenario& scenario, const std::vector<std::string>& ports,
                                    const std::string& keys_file, LinkKind links,
                                    const volatile std::sig_atomic_t* stop,
                                    const std::function<void(const LiveSwarm&)>& show);

/// The [[frame]] tables that a daemon's configuration needs for this scenario: one for each robot
/// whose coordinates start where it is switched on, as those of AVR robots do. Links are called
/// radio-1, radio-2 ... by their channel. Empty if there is none.
std::string FramesForDaemon(const Scenario& scenario);

}  // namespace pheromone::swarm
