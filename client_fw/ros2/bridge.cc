#include "client_fw/ros2/bridge.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/ros2/bridged_robot.h"
#include "client_fw/ros2/due.h"
#include "client_fw/ros2/node.h"
#include "client_fw/ros2/robot_report.h"
#include "client_fw/ros2/server_thread.h"
#include "client_fw/ros2/text.h"
#include "server/base/say_line.h"

namespace pheromone::ros2 {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr int64_t kGraphMs = 100;
constexpr int64_t kReportMs = 20;
constexpr int64_t kPartingMs = 300;  // for the last zero speeds to arrive

class Bridge {
 public:
  Bridge(const BridgeOptions& options, const keys::RobotsKeys& robots_keys, Node* node)
      : options_(options), node_(node), server_(node, options, &reports_) {
    for (const RobotEntry& entry : options.robots) {
      robots_.emplace_back(node, options, robots_keys, entry, &server_);
    }
    if (options.localisation == Localisation::kTf && !robots_.empty()) {
      frames_ = node->Subscribe<TFMessage>("/tf", Quality::kFrames);
      static_frames_ = node->Subscribe<TFMessage>("/tf_static", Quality::kStatic);
    }
    if (options.allowed.halt) {
      halt_ = node->Subscribe<Empty>("/pheromone/halt", Quality::kOrders);
    }
  }

  void Run(const volatile std::sig_atomic_t* stop) {
    while (*stop == 0) {
      Turn();
      Wait();
    }
    for (BridgedRobot& robot : robots_) {
      robot.Stop();
    }
    node_->Flush(kPartingMs);
    SayLine(now_ms_, "ended; robots that were driven are told to stand");
  }

 private:
  void Turn() {
    now_ms_ = (MonotonicNs() - start_ns_) / kNsPerMs;
    static_frames_.Receive([&](const TFMessage& message) { OnTransforms(message); });
    frames_.Receive([&](const TFMessage& message) { OnTransforms(message); });
    halt_.Receive([&](const Empty&) {
      SayLine(now_ms_, "halt, by /pheromone/halt");
      for (BridgedRobot& robot : robots_) {
        robot.Halt();
      }
      if (!options_.socket.empty()) {  // the server's other robots
        server_.Send("halt", "/api/v1/halt", "{}");
      }
    });
    for (BridgedRobot& robot : robots_) {
      robot.Turn(now_ms_);
    }
    if (reports_due_.Claim(now_ms_)) {
      std::vector<RobotReport> reports;
      for (const BridgedRobot& robot : robots_) {
        reports.push_back(robot.MakeReport());
      }
      reports_.Set(std::move(reports));
    }
    if (graph_due_.Claim(now_ms_)) {
      node_->Step();
      for (BridgedRobot& robot : robots_) {
        robot.Report(now_ms_);
      }
    }
  }

  void OnTransforms(const TFMessage& message) {
    for (uint32_t i = 0; i < message.transforms._length; ++i) {
      const auto& it = message.transforms._buffer[i];
      const auto& at = it.transform.translation;
      const std::string parent = FrameOf(it.header.frame_id);
      const std::string child = FrameOf(it.child_frame_id);
      for (BridgedRobot& robot : robots_) {
        robot.OnTransform(parent, child, ToPlane(at.x, at.y, it.transform.rotation));
      }
    }
  }

  // Until the next millisecond, or until a server answers.
  void Wait() {
    waited_.clear();
    for (const BridgedRobot& robot : robots_) {
      waited_.push_back({robot.descriptor(), robot.poll_events(), 0});
    }
    poll(waited_.data(), waited_.size(), 1);
  }

  const BridgeOptions& options_;
  Node* const node_;
  RobotReports reports_;
  ServerThread server_;
  std::list<BridgedRobot> robots_;
  Subscription<TFMessage> frames_;
  Subscription<TFMessage> static_frames_;
  Subscription<Empty> halt_;
  std::vector<pollfd> waited_;
  int64_t start_ns_ = MonotonicNs();
  int64_t now_ms_ = 0;
  Due graph_due_{kGraphMs};
  Due reports_due_{kReportMs};
};

}  // namespace

Status RunBridge(const BridgeOptions& options, const keys::RobotsKeys& robots_keys,
                 const Discovery& discovery, const volatile std::sig_atomic_t* stop) {
  PHEROMONE_TRY(const std::unique_ptr<Node> node, Node::Create(discovery, options.distro));
  Bridge bridge(options, robots_keys, node.get());
  PHEROMONE_TRY_STATUS(node->status());
  SayLine(0, fmt::format("node /pheromone in domain {}", discovery.domain));
  bridge.Run(stop);
  return Ok();
}

}  // namespace pheromone::ros2
