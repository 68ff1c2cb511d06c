// A robot of the bench with two trails: it follows lines from tag to tag, fires its net there, and
// carries energy from the source to the nest.
//
//   Forager forager(kRobotNet, NetRobotParameters(), id, boot_counter, &memory);
//   Robot<Board, Drive, Forager> robot(...);                // robot.h calls it, as Task
//
// What it does at tags is NetRobot's; here are its legs. It follows the line of its place, and
// stands at a tag until the net lets it go on. At an exception it halts, with an EVENT; COMMAND
// resume lets it try again. Where robots queue, their sonar keeps the distance (range_limit.h).
#pragma once

#include <stdint.h>

#include "client_fw/core/base/moment.h"
#include "client_fw/core/conversation.h"
#include "client_fw/core/tasks/net_robot.h"

namespace pheromone {
namespace client {

/// Other defaults than a follower's: half of its turns are for tags, and the first line is the
/// net's.
void PrepareForForaging(const NetTables& net, Parameters* parameters);

class Forager {
 public:
  /// `memory` must outlive the robot.
  Forager(const NetTables& net, const NetRobotParameters& parameters, uint8_t id,
          uint16_t boot_counter, NetMemory* memory)
      : net_robot_(net, parameters, id, boot_counter, memory) {}

  // What Robot asks of a Task.
  void Step(Moment now_ms, const Odometry* odometry, Conversation* conversation);
  /// Zero while it stands at a tag.
  WheelSpeeds Wheels(const Conversation& conversation) const {
    return net_robot_.drives() ? conversation.state().wheels : WheelSpeeds{0, 0};
  }
  /// Its energy is where a robot's load is.
  bool HoldsLoad() const { return net_robot_.state().energy != 0; }

  const NetRobot& net_robot() const { return net_robot_; }

 private:
  NetRobot net_robot_;
};

}  // namespace client
}  // namespace pheromone
