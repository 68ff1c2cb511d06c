// What pheromone-ros2 is told on its command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_fw/attach/address.h"
#include "client_fw/core/steering/parameters.h"
#include "client_fw/keys/robots_keys.h"
#include "client_fw/ros2/node.h"
#include "client_fw/ros2/ros_robot.h"
#include "server/base/result.h"

namespace pheromone::ros2 {

/// Where a robot's pose on the map comes from.
enum class Localisation : uint8_t {
  kStart,  ///< a start pose and odometry
  kTf,     ///< map -> odometry, from /tf and /tf_static
  kAmcl,   ///< NAMESPACE/amcl_pose
};

struct RobotEntry {
  std::string name_space;  ///< without a slash in front
  uint8_t id = 1;
  std::optional<PlanePose> start;
};

/// Inputs that change something; each is off unless it was allowed.
struct Allowed {
  bool enable = false;
  bool halt = false;
  bool goal = false;
  bool deposit = false;
  bool paint = false;
};

struct BridgeOptions {
  std::vector<RobotEntry> robots;
  std::vector<attach::Address> servers;
  client::Parameters client;
  double track_m = 0.16;
  bool stamped = false;
  Localisation localisation = Localisation::kStart;
  std::string map_frame = "map";
  Distro distro = Distro::kAuto;
  Allowed allowed;
  std::string socket;  ///< of the server, for maps and orders; empty: none
  std::string link;    ///< the server's name of the link over which the robots reach it
  std::string keys;    ///< a file, as the server has it; empty: frames are not signed
};

/// "NAMESPACE:ID" or "NAMESPACE:ID:X,Y,DEGREES". Errors name the part, and what was expected.
Result<RobotEntry> ParseRobot(const std::string& text);

/// What is wrong with values that are right one by one. An option without effect is an error;
/// `for_robots` are those that were given and are about robots.
Status CheckOptions(const BridgeOptions& options, const std::vector<std::string>& for_robots = {});

/// Of options that are right, the robots' keys; none without a file. Each call counts a start.
/// Errors: those of keys::TakeKeys.
Result<keys::RobotsKeys> TakeRobotsKeys(const BridgeOptions& options);

}  // namespace pheromone::ros2
