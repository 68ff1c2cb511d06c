// A robot on the double bridge: the firmware's main loop on the host board, wheels with a random
// component, and the corridors around them.
//
//   BridgeRobot robot(config, &arena);
//   robot.Advance(0.01, /*short_open=*/true);      // 10 ms of driving
//   robot.Step(now_ms, /*carrier=*/false);         // one turn of the firmware's main loop
//   const size_t size = robot.TakeTransmission(frame, sizeof frame);
//
// The wheels reach their commanded speed at once, and the odometry is exact. Exploration is part of
// the drive: the robot's turning rate has a random part, an Ornstein-Uhlenbeck process, as a
// walking ant sways. At the end of a stem the robot stops for a while and is then turned to face
// the fork. Robots do not hinder each other.
//
// One thread. The same configuration and calls give the same driving.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/core/robot.h"
#include "client_fw/experiments/bridge/arena.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/sim/released.h"

namespace pheromone::swarm {

/// The random part of a robot's turning rate.
struct Wandering {
  double rad_s = 0.25;    ///< standard deviation
  double memory_s = 0.5;  ///< after which the correlation has fallen to 1/e
};

struct BridgeRobotConfig {
  client::Parameters client = sim::ReleasedParameters();
  Wandering wandering;
  double wheelbase_m = 0.33;
  double turn_s = 2;  ///< at the end of a stem
  uint64_t seed = 1;
};

/// A Drive for client_fw/core/robot.h.
class BridgeDrive {
 public:
  /// `arena` outlives the drive.
  BridgeDrive(const BridgeRobotConfig& config, const BridgeArena* arena);

  BridgeGuide::Step Advance(double seconds, bool short_open);

  // The Drive concept.
  bool odometry(client::Odometry* odometry) const;
  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s);
  void emergency_stop() {}  // it has no inertia: zero speeds follow
  const client::DriveStatus& status() const { return status_; }

  const sim::PlanePose& pose() const { return pose_; }
  const BridgeGuide& guide() const { return guide_; }

 private:
  double Wander(double seconds);

  Wandering wandering_;
  double wheelbase_m_;
  double turn_s_;
  BridgeGuide guide_;
  sim::PlanePose pose_;
  double left_m_s_ = 0;
  double right_m_s_ = 0;
  double wander_rad_s_ = 0;
  double standing_s_ = 0;  // still to stand at the end of a stem
  std::mt19937_64 random_;
  client::DriveStatus status_ = client::kNothingToTell;
};

class BridgeRobot final : public sim::Station {
 public:
  BridgeRobot(const BridgeRobotConfig& config, const BridgeArena* arena);
  BridgeRobot(const BridgeRobot&) = delete;
  BridgeRobot& operator=(const BridgeRobot&) = delete;

  BridgeGuide::Step Advance(double seconds, bool short_open) {
    return drive_.Advance(seconds, short_open);
  }
  void Step(int64_t now_ms, bool carrier);

  /// A frame that the robot wants to send, or 0 bytes; then OnTransmitted is due.
  size_t TakeTransmission(std::span<uint8_t> frame);
  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t time_ns) override;

  const sim::PlanePose& pose() const { return drive_.pose(); }
  const BridgeGuide& guide() const { return drive_.guide(); }
  const client::Conversation& conversation() const { return robot_.conversation(); }

 private:
  client::HostBoard board_;
  BridgeDrive drive_;
  client::RequestMemory memory_{};
  client::Robot<client::HostBoard, BridgeDrive> robot_;
};

}  // namespace pheromone::swarm
