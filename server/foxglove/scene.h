// How robots, their trails and places look in viewers: entities for SceneUpdate. The stream and
// recordings for viewers show the same.
//
//   RobotLook robot{.link = "radio-a", .id = 7, .pose = ..., .left = ..., .right = ...};
//   update.entities.push_back(RobotEntity(robot));
//
// Units as in messages.h. Functions of their arguments; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/foxglove/messages.h"

namespace pheromone::foxglove {

/// Without news for this long, viewers remove a robot by themselves.
constexpr uint64_t kRobotLifetimeNs = 5'000'000'000;

/// "LINK/ID": what names a robot in entities.
std::string RobotName(std::string_view link, uint8_t id);
/// "robot/LINK/ID": its frame.
std::string RobotFrame(std::string_view link, uint8_t id);
/// A colour of its own for each of the first few IDs, distinguishable by the colour-blind.
Colour RobotColour(uint8_t id);

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
Entity RobotEntity(const RobotLook& robot);

/// A line along its last positions.
Entity TrailEntity(std::string_view link, uint8_t id, std::vector<Point> points);

/// A named place with a circle around it: a tag with its range, a goal with its tolerance.
Entity PlaceEntity(std::string id, std::string label, Point centre, double radius_m,
                   const Colour& colour);

}  // namespace pheromone::foxglove
