// The configuration of pheromone-tracker: a TOML file, described in pheromone-tracker(1).
//
//   Result<Settings> settings = LoadSettings("ceiling.toml");
//
// Errors say line and column, what was found and what was expected; one run finds all of them. Any
// thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client_fw/tracker/geometry.h"
#include "server/base/result.h"
#include "server/net/endpoint.h"

namespace pheromone::tracker {

struct FloorTag {
  int tag = 0;
  Point place = {0, 0};  ///< of its middle, m
  double heading_rad = 0;
};

struct RobotTag {
  int tag = 0;
  std::string link;
  int id = 0;
  double height_m = 0;  ///< of the tag above the floor
  /// Where the tag is on the robot, and how it is turned against it, counter-clockwise.
  double forward_m = 0;
  double left_m = 0;
  double turn_rad = 0;
};

struct Settings {
  Endpoint server;  ///< of the [[tracker]]
  std::string device;
  int width = 0;
  int height = 0;
  Lens lens;  ///< its focal_px is 0 if it is not known yet
  double floor_edge_m = 0;
  double robot_edge_m = 0;
  std::vector<FloorTag> floor;  ///< three or more
  std::vector<RobotTag> robots;
};

Result<Settings> ParseSettings(std::string_view text, std::string_view name);
Result<Settings> LoadSettings(const std::string& path);

/// Whether the lens is known, without which nothing can be located.
Status CheckLens(const Settings& settings);

}  // namespace pheromone::tracker
