// What a robot's state, as the server names it (server/operators/control/condition.h), looks like
// to viewers of ROS: one table for markers and diagnostics.
#pragma once

#include <array>
#include <string_view>

#include "client_fw/ros2/message_kinds.h"
#include "client_fw/ros2/robot_report.h"

namespace pheromone::ros2 {

using Color = std_msgs_msg_dds__ColorRGBA_;

// Okabe and Ito's colours, which colour-blind people tell apart.
constexpr Color kBlue = {0.0f, 0.45f, 0.7f, 1};
constexpr Color kGreen = {0.0f, 0.62f, 0.45f, 1};
constexpr Color kOrange = {0.9f, 0.62f, 0.0f, 1};
constexpr Color kVermilion = {0.84f, 0.37f, 0.0f, 1};
constexpr Color kGrey = {0.5f, 0.5f, 0.5f, 1};

struct StateStyle {
  std::string_view state;
  Health health;
  Color color;
};

/// States that are not in the table, of a newer server too, are grey warnings.
inline StateStyle StyleOf(std::string_view state) {
  static constexpr std::array<StateStyle, 8> kStyles = {{{"driving", Health::kOk, kGreen},
                                                         {"going to its goal", Health::kOk, kGreen},
                                                         {"at its goal", Health::kOk, kGrey},
                                                         {"trail lost", Health::kWarning, kOrange},
                                                         {"off the map", Health::kWarning, kOrange},
                                                         {"refused", Health::kError, kVermilion},
                                                         {"alarm", Health::kError, kVermilion},
                                                         {"silent", Health::kError, kVermilion}}};
  for (const StateStyle& it : kStyles) {
    if (it.state == state) {
      return it;
    }
  }
  return {state, Health::kWarning, kGrey};
}

}  // namespace pheromone::ros2
