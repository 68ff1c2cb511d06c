// The shipped AVR image between a radio channel with the real engine on it and a simulated Pioneer,
// in virtual time, with a record of all frames on the channel.
//
//   FirmwareWorld world;
//   world.RunFor(10'000);                                     // ms
//   world.robot().true_pose(); world.heard(); world.Deposits();
//
// The robot, ID 7, starts at the map's origin of coordinates, facing along +x, where a path leads
// (Path()). Path and trail are of pheromone type 1, which does not evaporate, so every quantum ever
// deposited is still there. One thread; deterministic.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <vector>

#include "client_fw/core/steering/settings.h"
#include "client_fw/sim/avr/avr_robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/server_station.h"
#include "protocol/decoder.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"
#include "server/core/field/path.h"

namespace pheromone::firmware {

constexpr uint8_t kRobotId = 7;

/// A frame on the channel.
struct HeardFrame {
  int64_t end_ms = 0;
  protocol::Message message;
};

class FirmwareWorld {
 public:
  /// `eeprom`: the contents of the robot's EEPROM from address 0; the rest is erased. Without, a
  /// robot with default settings, but released.
  explicit FirmwareWorld(uint64_t seed = 1, const sim::RadioConfig& radio = {},
                         const std::vector<uint8_t>& eeprom = Released(),
                         const sim::PioneerConfig& pioneer = {});
  FirmwareWorld(const FirmwareWorld&) = delete;
  FirmwareWorld& operator=(const FirmwareWorld&) = delete;

  void RunFor(int64_t ms);
  /// Runs until `happened` returns true, for at most `ms`. Returns whether it did.
  bool RunUntil(const std::function<bool()>& happened, int64_t ms);
  int64_t now_ms() const { return medium_.now_ns() / 1'000'000; }

  sim::AvrRobot& robot() { return robot_; }
  const sim::AvrRobot& robot() const { return robot_; }
  engine::Service& service() { return servers_.back().service; }
  const sim::RadioMedium& medium() const { return medium_; }

  /// Resets the robot's processor within the next millisecond.
  void ResetAfter(int64_t ns, sim::AvrMachine::Cause cause);

  /// Switches the server off: it still receives, but does nothing.
  void StopServer() { running_ = false; }
  /// Starts a new server without the old one's state.
  void StartServer();

  /// The EEPROM of a robot with default settings that drives without being released.
  static std::vector<uint8_t> Released();

  /// Sends a COMMAND until it is acknowledged. False if it was not within 5 s, or was refused.
  bool Command(protocol::CommandCode code, std::vector<uint8_t> arguments = {});
  /// Tells the robot where it is: mm, mm, binary angle.
  bool GivePose(int32_t x_mm, int32_t y_mm, uint16_t heading);
  /// EVENTs with this code.
  size_t CountEvents(protocol::EventCode code, size_t from = 0) const;

  /// Sends COMMAND 8 until it is acknowledged. False if it was not within 5 s.
  bool Set(client::SettingId setting, int32_t value);

  /// Frames of the robot and of the server since the start, oldest first.
  const std::vector<HeardFrame>& heard() const { return ear_.heard; }
  /// Of a client opcode: the last one, if any.
  const HeardFrame* LastHeard(uint8_t opcode) const;
  size_t CountHeard(uint8_t opcode, size_t from = 0) const;

  /// Quanta on the map beyond those of the path.
  uint64_t Deposits() const;

  static field::Path Path();
  /// From the robot to the path, in metres, and how far along the path that is.
  struct Place {
    double off_path_m;
    double along_m;
  };
  Place WhereIsTheRobot() const;

 private:
  struct Server {
    Server(uint16_t epoch, sim::RadioMedium* medium);
    engine::VolatileLog log;
    engine::Service service;
    swarm::ServerStation station;
    uint64_t quanta_of_path;
  };
  struct Ear final : sim::Station {
    void OnByte(uint8_t byte, int64_t time_ns) override;
    void OnTransmitted(int64_t /*time_ns*/) override {}
    protocol::FrameDecoder decoder{20};
    std::vector<HeardFrame> heard;
  };

  static uint64_t QuantaOf(const engine::Service& service);

  sim::RadioMedium medium_;
  Ear ear_;
  uint16_t epoch_ = 1;
  bool running_ = true;
  std::list<Server> servers_;  // the last one is on; the medium points at all
  sim::AvrRobot robot_;
};

}  // namespace pheromone::firmware
