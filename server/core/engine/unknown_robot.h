// How a robot that is not there is named, beside those that are.
#pragma once

#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/core/engine/event.h"
#include "server/core/engine/robot_table.h"

namespace pheromone::engine {

/// `no robot 9 has said HELLO on link "radio-a", expected one of 1, 3`. `link` may be out of range.
inline Error UnknownRobot(const RobotTable& robots, const std::vector<LinkSettings>& links,
                          LinkIndex link, uint8_t id) {
  std::string known;
  robots.ForEachOf(link, [&](uint8_t other, const RobotState&) {
    known += (known.empty() ? "" : ", ") + std::to_string(other);
  });
  return Error{"no robot " + std::to_string(id) + " has said HELLO on link \"" +
               (link < links.size() ? links[link].name : std::to_string(link)) + "\"" +
               (known.empty() ? ", nor has any other" : ", expected one of " + known)};
}

}  // namespace pheromone::engine
