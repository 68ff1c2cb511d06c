// A robot of pheromone-ros2: its topics below NAMESPACE, its way to the server, and the RosRobot
// between them.
//
//   BridgedRobot robot(node, options, robots_keys, options.robots[0], &server);
//   robot.OnTransform("map", "tb1/odom", transform);       // of /tf, if that is used
//   robot.Turn(now_ms);                                    // every millisecond
//   poll(robot.descriptor(), robot.poll_events())
//
// One thread. Nothing blocks.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "client_fw/attach/servers.h"
#include "client_fw/keys/robots_keys.h"
#include "client_fw/ros2/node.h"
#include "client_fw/ros2/options.h"
#include "client_fw/ros2/robot_report.h"
#include "client_fw/ros2/ros_robot.h"
#include "client_fw/ros2/server_thread.h"

namespace pheromone::ros2 {

class BridgedRobot {
 public:
  /// All outlive it. `robots_keys` has the robot's, or is empty: it does not sign. `server` takes
  /// its orders.
  BridgedRobot(Node* node, const BridgeOptions& options, const keys::RobotsKeys& robots_keys,
               const RobotEntry& entry, ServerThread* server);
  BridgedRobot(const BridgedRobot&) = delete;
  BridgedRobot& operator=(const BridgedRobot&) = delete;

  /// Before odometry has told its frame, the last one of each child of the map is kept: a latched
  /// one does not come again.
  void OnTransform(const std::string& parent, const std::string& child, const PlanePose& transform);
  void Halt() { robot_.Halt(); }
  void Turn(int64_t now_ms);
  /// Says so when what it does has changed.
  void Report(int64_t now_ms);
  /// Zero speed, if it was driving.
  void Stop();

  int descriptor() const { return servers_.connection().descriptor(); }
  short poll_events() const { return servers_.connection().poll_events(); }

  RobotReport MakeReport() const;

 private:
  /// What it does, and why: "drives", "stands: halted, until it is told to resume".
  std::string StateText() const;
  void ReceiveMessages(int64_t now_ms);
  void OnGoal(const PoseStamped& goal, int64_t now_ms);
  void ExchangeFrames(int64_t now_ms);
  void PublishSpeed(const Speed& speed);
  void PublishSensed();

  const BridgeOptions& options_;
  const RobotEntry entry_;
  ServerThread* const server_;
  RosRobot robot_;
  attach::Servers servers_;
  bool sending_ = false;
  std::string odometry_frame_;              // such as "tb1/odom"; empty before the first message
  std::map<std::string, PlanePose> early_;  // until then: transforms from the map, by child
  std::optional<PlanePose> amcl_;           // the last one, until there is odometry to join it with
  std::string said_;
  Subscription<Odometry> odometry_;
  Subscription<PoseWithCovarianceStamped> amcl_pose_;
  Subscription<Bool> enable_;
  Subscription<PoseStamped> goal_;
  Publisher<Twist> twist_;
  Publisher<TwistStamped> stamped_twist_;
  Publisher<Float32MultiArray> sensed_;
};

}  // namespace pheromone::ros2
