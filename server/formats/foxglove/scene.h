// How robots, their trails and places look in viewers: entities of a SceneUpdate. The stream and
// recordings for viewers show the same.
//
//   AddRobot({.link = "radio-a", .id = 7, .pose = ..., .left = ..., .right = ...}, now_ns,
//   &update);
//
// Units as in messages.h. Functions of their arguments; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/formats/foxglove/messages.h"

namespace pheromone::foxglove {

/// Without news for this long, viewers remove a robot by themselves.
constexpr uint64_t kRobotLifetimeS = 5;

/// "LINK/ID": what names a robot in entities.
std::string RobotName(std::string_view link, uint8_t id);
/// "robot/LINK/ID": its frame.
std::string RobotFrame(std::string_view link, uint8_t id);

struct Colour {
  double r = 0;  ///< each from 0 to 1
  double g = 0;
  double b = 0;
  double a = 1;
};

struct RobotLook {
  std::string link = {};
  uint8_t id = 0;
  Pose pose = {};
  Point left = {};  ///< the antennas, on the map
  Point right = {};
  double size_m = 0.25;  ///< length of the arrow
  std::vector<std::pair<std::string, std::string>> facts = {};
};

/// An arrow, two spheres for the antennas, and the label "ID".
void AddRobot(const RobotLook& robot, uint64_t time_ns, SceneUpdate* update);

/// A line along its last positions.
void AddTrail(std::string_view link, uint8_t id, const std::vector<Point>& points, uint64_t time_ns,
              SceneUpdate* update);

/// For swarms: a short line from each pose ahead, all of them one entity.
void AddHeadings(std::string id, const std::vector<Pose>& poses, double size_m, uint64_t time_ns,
                 SceneUpdate* update);

struct PlaceLook {
  std::string id = {};
  std::string label = {};
  Point centre = {};
  double radius_m = 0;
  Colour colour = {};
};

/// A named place with a circle around it: a tag with its range, a goal with its tolerance.
void AddPlace(const PlaceLook& place, uint64_t time_ns, SceneUpdate* update);

}  // namespace pheromone::foxglove
