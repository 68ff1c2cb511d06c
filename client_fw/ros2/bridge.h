// Joins robots of ROS 2 with a pheromone server, in real time.
//
//   const Status run = RunBridge(options, robots_keys, discovery, StopOnSignals());
//
// Prints what happens. Blocks until it is told to stop; nothing else in it blocks.
#pragma once

#include <csignal>

#include "client_fw/keys/robots_keys.h"
#include "client_fw/ros2/environment.h"
#include "client_fw/ros2/options.h"
#include "server/base/result.h"

namespace pheromone::ros2 {

/// Runs until `*stop` is not 0, then tells all robots that it drives to stand. `robots_keys` are of
/// all robots, or empty: they do not sign. Error: DDS.
Status RunBridge(const BridgeOptions& options, const keys::RobotsKeys& robots_keys,
                 const Discovery& discovery, const volatile std::sig_atomic_t* stop);

}  // namespace pheromone::ros2
