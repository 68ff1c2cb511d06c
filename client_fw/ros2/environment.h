// Where other nodes are, by the environment variables of ROS 2: ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY
// (Humble), ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_STATIC_PEERS (Iron and later), CYCLONEDDS_URI.
//
//   Result<Discovery> discovery = ReadEnvironment(getenv);
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/base/result.h"

namespace pheromone::ros2 {

struct Discovery {
  uint32_t domain = 0;  ///< 0 to 232
  /// Cyclone DDS's configuration: XML, then what CYCLONEDDS_URI says, which prevails. May be empty.
  std::string config;
};

/// `get` returns the value of a variable, or null. Errors name the variable, its value and what was
/// expected.
Result<Discovery> ReadEnvironment(const std::function<const char*(const char*)>& get);

}  // namespace pheromone::ros2
