#include "client_fw/ros2/bridged_robot.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

#include "client_fw/attach/reporter.h"
#include "client_fw/boards/host/stop_text.h"
#include "client_fw/ros2/text.h"
#include "server/base/say_line.h"

namespace pheromone::ros2 {
namespace {

constexpr int kMaxReads = 16;
constexpr float kUnit = 4096;

client::Parameters ParametersOf(const BridgeOptions& options, const keys::RobotsKeys& robots_keys,
                                const RobotEntry& entry) {
  client::Parameters parameters = options.client;
  parameters.id = entry.id;
  if (entry.start) {
    parameters.start = ToClientPose(*entry.start);
  }
  parameters.boot_counter = static_cast<uint16_t>(std::random_device{}());
  if (!robots_keys.keys.empty()) {
    parameters.key = robots_keys.keys.at(entry.id).data();
    parameters.boot_counter = robots_keys.first_start;
  }
  parameters.buffered_link = true;  // networks deliver late
  parameters.gap_timeout_ms = 0;
  parameters.rounds = false;
  return parameters;
}

}  // namespace

BridgedRobot::BridgedRobot(Node* node, const BridgeOptions& options,
                           const keys::RobotsKeys& robots_keys, const RobotEntry& entry,
                           ServerThread* server)
    : options_(options),
      entry_(entry),
      server_(server),
      robot_(ParametersOf(options, robots_keys, entry), options.track_m,
             entry.start ? PoseSource::kStart : PoseSource::kMap),
      servers_(options.servers, entry.id) {
  const std::string below = "/" + entry.name_space;
  odometry_ = node->Subscribe<Odometry>(below + "/odom", Quality::kSensor);
  sensed_ = node->Advertise<Float32MultiArray>(below + "/pheromone/sensed", Quality::kOrders);
  if (options.stamped) {
    stamped_twist_ = node->Advertise<TwistStamped>(below + "/cmd_vel", Quality::kOrders);
  } else {
    twist_ = node->Advertise<Twist>(below + "/cmd_vel", Quality::kOrders);
  }
  if (options.localisation == Localisation::kAmcl) {
    amcl_pose_ = node->Subscribe<PoseWithCovarianceStamped>(below + "/amcl_pose", Quality::kStatic);
  }
  if (options.allowed.enable) {
    enable_ = node->Subscribe<Bool>(below + "/pheromone/enable", Quality::kOrders);
  }
  if (options.allowed.goal) {
    goal_ = node->Subscribe<PoseStamped>(below + "/goal_pose", Quality::kOrders);
  }
}

void BridgedRobot::OnTransform(const std::string& parent, const std::string& child,
                               const PlanePose& transform) {
  if (options_.localisation != Localisation::kTf || parent != options_.map_frame) {
    return;
  }
  if (odometry_frame_.empty()) {
    early_.insert_or_assign(child, transform);
  } else if (child == odometry_frame_) {
    robot_.OnMapToOdometry(transform);
  }
}

void BridgedRobot::ReceiveMessages(int64_t now_ms) {
  odometry_.Receive([&](const Odometry& message) {
    odometry_frame_ = FrameOf(message.header.frame_id);
    robot_.OnOdometry(ToPlane(message.pose.pose), now_ms);
    if (const auto early = early_.find(odometry_frame_); early != early_.end()) {
      robot_.OnMapToOdometry(early->second);
    }
    early_.clear();
  });
  amcl_pose_.Receive([&](const PoseWithCovarianceStamped& message) {
    if (FrameOf(message.header.frame_id) == options_.map_frame) {
      amcl_ = ToPlane(message.pose.pose);
    }
  });
  if (amcl_ && robot_.has_odometry()) {
    robot_.OnMapToOdometry(Compose(*amcl_, Inverse(robot_.odometry())));
    amcl_.reset();
  }
  enable_.Receive([&](const Bool& message) { robot_.Enable(message.data); });
  goal_.Receive([&](const PoseStamped& message) { OnGoal(message, now_ms); });
}

void BridgedRobot::OnGoal(const PoseStamped& goal, int64_t now_ms) {
  const auto& at = goal.pose.position;
  const std::string name = entry_.name_space + ": goal";
  const std::string frame = FrameOf(goal.header.frame_id);
  if (frame != options_.map_frame || !std::isfinite(at.x) || !std::isfinite(at.y)) {
    SayLine(now_ms, fmt::format("{}: frame \"{}\", expected finite x and y in \"{}\"", name, frame,
                                options_.map_frame));
    return;
  }
  server_->Send(name, "/api/v1/goto",
                boost::json::serialize(boost::json::object{
                    {"link", options_.link}, {"id", entry_.id}, {"x_m", at.x}, {"y_m", at.y}}));
}

void BridgedRobot::ExchangeFrames(int64_t now_ms) {
  servers_.Advance(now_ms);
  for (int i = 0; i < kMaxReads; ++i) {
    const std::span<const uint8_t> bytes = servers_.Read(now_ms);
    if (bytes.empty()) {
      break;
    }
    robot_.OnServerBytes(bytes);
  }
  servers_.Choose(now_ms);
  if (servers_.TakeNewEpoch()) {
    robot_.GreetAgain();
  }
  if (sending_ && servers_.connection().drained(now_ms)) {
    sending_ = false;
    robot_.OnFrameSent();
  }
}

void BridgedRobot::Turn(int64_t now_ms) {
  ReceiveMessages(now_ms);
  ExchangeFrames(now_ms);
  robot_.Step(now_ms);
  if (const auto speed = robot_.ClaimSpeed()) {
    PublishSpeed(*speed);
  }
  if (robot_.ClaimSensed()) {
    PublishSensed();
  }
  if (const std::vector<uint8_t> frame = robot_.ClaimFrame(); !frame.empty()) {
    servers_.Write(frame, now_ms);
    sending_ = true;
  }
}

void BridgedRobot::PublishSpeed(const Speed& speed) {
  const Twist twist{{speed.forward_m_s, 0, 0}, {0, 0, speed.turn_rad_s}};
  if (options_.stamped) {
    stamped_twist_.Publish({MakeHeader(""), twist});
  } else {
    twist_.Publish(twist);
  }
}

void BridgedRobot::PublishSensed() {
  const client::BehaviourState& state = robot_.conversation().state();
  std::vector<float> values = {static_cast<float>(state.p_left) / kUnit,
                               static_cast<float>(state.p_right) / kUnit};
  Float32MultiArray message{};
  PointAt(&message.data, &values);
  sensed_.Publish(message);
}

void BridgedRobot::Stop() {
  if (robot_.released()) {
    PublishSpeed({});
  }
}

std::string BridgedRobot::StateText() const {
  if (!robot_.has_odometry()) {
    return odometry_frame_.empty() ? "stands: no odometry yet" : "stands: odometry has stopped";
  }
  if (!robot_.has_place()) {
    return "stands: no pose on the map";
  }
  const client::BehaviourState& state = robot_.conversation().state();
  return attach::MotionText(state.flags, state.trail_lost, true);
}

RobotReport BridgedRobot::MakeReport() const {
  const client::Conversation& conversation = robot_.conversation();
  const uint8_t flags = conversation.state().flags;
  constexpr uint8_t kHarmless = client::kHalted | client::kTrailLost | client::kNoAnswerYet;
  const bool wrong = !robot_.has_place() || (flags & ~kHarmless) != 0;
  return {.name_space = entry_.name_space,
          .id = entry_.id,
          .health = wrong        ? Health::kError
                    : flags != 0 ? Health::kWarning
                                 : Health::kOk,
          .state = StateText(),
          .odometry = robot_.has_odometry() ? std::optional(robot_.odometry()) : std::nullopt,
          .odometry_frame = odometry_frame_,
          .requests = conversation.counters().requests,
          .answers = conversation.counters().answers};
}

void BridgedRobot::Report(int64_t now_ms) {
  const std::string text = entry_.name_space + ": " + StateText();
  if (text != said_) {
    SayLine(now_ms, text);
    said_ = text;
  }
}

}  // namespace pheromone::ros2
