// Strings and poses in messages of Cyclone DDS's C API, whose strings are not constant.
#pragma once

#include <cmath>
#include <cstdint>
#include <ctime>
#include <string>

#include "client_fw/ros2/message_kinds.h"
#include "client_fw/ros2/ros_robot.h"

namespace pheromone::ros2 {

using Header = std_msgs_msg_dds__Header_;
using RosPose = geometry_msgs_msg_dds__Pose_;
using Quaternion = geometry_msgs_msg_dds__Quaternion_;

/// For a message that is only sent; `text` has to outlive it.
inline char* Text(const std::string& text) {
  return const_cast<char*>(text.c_str());
}

/// Now; `frame` has to outlive it.
inline Header MakeHeader(const std::string& frame) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return {{static_cast<int32_t>(now.tv_sec), static_cast<uint32_t>(now.tv_nsec)}, Text(frame)};
}

inline Quaternion ToQuaternion(double yaw) {
  return {0, 0, std::sin(yaw / 2), std::cos(yaw / 2)};
}

inline PlanePose ToPlane(double x_m, double y_m, const Quaternion& q) {
  return {x_m, y_m, std::atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))};
}

inline PlanePose ToPlane(const RosPose& pose) {
  return ToPlane(pose.position.x, pose.position.y, pose.orientation);
}

inline std::string TextOf(const char* text) {
  return text == nullptr ? "" : text;
}

/// "tb1/odom" and "/tb1/odom" are the same frame.
inline std::string FrameOf(const char* text) {
  const std::string frame = TextOf(text);
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

}  // namespace pheromone::ros2
