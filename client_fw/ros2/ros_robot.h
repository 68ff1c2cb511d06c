// A robot that ROS 2 drives: the firmware's own code (client_fw/core), fed by odometry, whose wheel
// speeds become a speed and a rate of turn. Without any I/O: messages, bytes and the time go in,
// speeds and frames come out.
//
//   RosRobot robot(parameters, 0.16, PoseSource::kStart);
//   robot.OnOdometry({x_m, y_m, heading_rad}, now_ms);
//   robot.OnServerBytes(bytes);
//   robot.Step(now_ms);                                   // every millisecond
//   if (const auto speed = robot.ClaimSpeed()) ...         // to cmd_vel
//   Write(robot.ClaimFrame());                             // to the server, then OnFrameSent()
//
// Speeds: v = (l + r) / 2, omega = (r - l) / track. There are none before a resume, since another
// node may be driving; after a halt there is zero for a second, then nothing. Odometry that is
// older than kOdometryMs stops the robot, which drives on when it returns.
//
// Where it is on the map: PoseSource::kStart adds what odometry has covered since its first message
// to a start pose. If odometry jumps or turns further than a robot can drive within kOdometryMs, it
// was reset, however long it was away: the pose is lost, and the robot halts until it is told where
// it is. PoseSource::kMap takes the transform from map to odometry that somebody else finds, and
// stands while there is none.
//
// One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/boards/host/plane_pose.h"
#include "client_fw/core/robot.h"

namespace pheromone::ros2 {

/// Odometry that is older than this stops the robot, which is told to stand at once.
constexpr int64_t kOdometryMs = 400;
/// For so long a halted robot is told to stand.
constexpr int64_t kStandMs = 1000;

using client::PlanePose;

/// What `pose` in the frame `frame` is in the one that contains `frame`.
PlanePose Compose(const PlanePose& frame, const PlanePose& pose);
PlanePose Inverse(const PlanePose& pose);

enum class PoseSource : uint8_t { kStart, kMap };

struct Speed {
  double forward_m_s = 0;
  double turn_rad_s = 0;
};

class RosRobot {
 public:
  /// `parameters.start` is not used with PoseSource::kMap. `track_m` is the distance of the wheels.
  RosRobot(const client::Parameters& parameters, double track_m, PoseSource source);
  RosRobot(const RosRobot&) = delete;
  RosRobot& operator=(const RosRobot&) = delete;

  /// Values that are not finite are ignored.
  void OnOdometry(const PlanePose& pose, int64_t now_ms);
  void OnMapToOdometry(const PlanePose& transform) { map_to_odometry_ = transform; }
  void OnServerBytes(std::span<const uint8_t> bytes);
  /// The server is another one, which does not know this robot.
  void GreetAgain() { robot_.GreetAgain(); }
  /// False: halts, and stays halted whatever the server says. True: permits it to drive, and
  /// resumes.
  void Enable(bool enabled);
  /// Halts, until a resume that comes after the next Step.
  void Halt() { halt_ = true; }

  void Step(int64_t now_ms);

  /// What is to be published, if anything.
  std::optional<Speed> ClaimSpeed();
  /// True, once for each answer: new intensities.
  bool ClaimSensed();
  /// A whole frame to the server, to be written at once; empty: none.
  std::vector<uint8_t> ClaimFrame();
  void OnFrameSent() { board_.OnTransmitted(); }

  const client::Conversation& conversation() const { return robot_.conversation(); }
  bool released() const { return (conversation().state().flags & client::kHalted) == 0; }
  /// Odometry is there and fresh.
  bool has_odometry() const { return fresh_; }
  bool has_place() const { return drive_.known; }
  /// As last reported; meaningful once there was one.
  const PlanePose& odometry() const { return odometry_; }
  /// Where the robot believes to be on the map; meaningful while has_place().
  client::Pose pose() const;

 private:
  struct Drive {
    bool odometry(client::Odometry* out) const {
      *out = place;
      return known;
    }
    void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
      wheels = {left_mm_s, right_mm_s};
      told = true;
    }
    void emergency_stop() { set_wheel_speeds(0, 0); }
    const client::DriveStatus& status() const { return state; }

    client::Odometry place{};
    bool known = false;
    client::WheelSpeeds wheels{};
    bool told = false;
    client::DriveStatus state = client::kNothingToTell;
  };

  std::optional<client::Pose> Place() const;

  const double track_m_;
  const PoseSource source_;
  client::HostBoard board_;
  Drive drive_;
  client::RequestMemory memory_{};
  client::Robot<client::HostBoard, Drive> robot_;
  std::vector<uint8_t> from_server_;
  int64_t now_ms_ = 0;
  std::optional<int64_t> odometry_ms_;
  PlanePose odometry_;
  std::optional<PlanePose> first_odometry_;
  std::optional<PlanePose> map_to_odometry_;
  bool fresh_ = false;
  bool disabled_ = false;
  bool halt_ = false;
  bool resume_ = false;
  bool jumped_ = false;
  int64_t silent_ms_ = 0;  // from then on nothing is published
  unsigned answers_ = 0;
};

}  // namespace pheromone::ros2
