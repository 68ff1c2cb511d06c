// Messages of ROS 2 as bags have them: in CDR (little-endian, aligned, with the header of four
// bytes that RTPS puts before it), with their definitions.
//
//   channel.schema_name = kPoseStamped;
//   channel.schema_encoding = "ros2msg";
//   channel.schema = DefinitionOf(kPoseStamped);
//   std::string message = EncodePose(utc_ns, {.x_m = 1.5, .y_m = 0.5, .yaw_rad = 1.57});
//
// Lengths are metres, angles radians counter-clockwise from +x, times nanoseconds since 1970; the
// frame is "map". Functions of their arguments; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace pheromone::ros {

constexpr std::string_view kOccupancyGrid = "nav_msgs/msg/OccupancyGrid";
constexpr std::string_view kPoseStamped = "geometry_msgs/msg/PoseStamped";
constexpr std::string_view kTransforms = "tf2_msgs/msg/TFMessage";

/// One of these types: its definition, then those that it uses, in the format "ros2msg".
std::string DefinitionOf(std::string_view type);

struct Pose {
  double x_m = 0;
  double y_m = 0;
  double yaw_rad = 0;
};

struct GridLayout {
  uint32_t columns = 0;  ///< at least 1
  double cell_m = 0;
  double x_m = 0;  ///< the lower left corner of the lower left cell
  double y_m = 0;
};

/// `cells`: one signed byte each, row by row from the bottom; 0 free to 100, -1 unknown.
std::string EncodeGrid(uint64_t time_ns, const GridLayout& layout, std::string_view cells);

std::string EncodePose(uint64_t time_ns, const Pose& pose);

struct Transform {
  std::string child;  ///< a frame, whose pose in the map it is
  Pose pose;
};
std::string EncodeTransforms(uint64_t time_ns, const std::vector<Transform>& transforms);

}  // namespace pheromone::ros
