// One robot whose firmware runs in a world: Robot<> of client_fw/core, on a board whose radio is a
// modelled link, with the world's wheels as its drive.
//
//   FirmwareRobot robot(parameters);
//   robot.See(pose);                           // where it believes to be
//   robot.Hear(message);                       // frames that have come, before the next Step
//   if (const protocol::Message* sent = robot.Step(now_ms)) ...   // good until the next Step
//   robot.wheels();                            // what the drive was told last
//
// A frame that is sent has left at once. Time is any that does not run backwards: as many Steps as
// something happens, not one a millisecond. One thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/core/robot.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::lab {

/// A Board (client_fw/core/robot.h).
class LinkBoard {
 public:
  int radio_get() { return read_ < heard_.size() ? heard_[read_++] : -1; }
  bool radio_put(uint8_t byte) {
    if (size_ == sent_.size()) {
      return false;
    }
    sent_[size_++] = byte;
    return true;
  }
  bool radio_tx_idle() const { return size_ == 0; }
  bool channel_busy() const { return size_ != 0; }
  client::Moment millis() const { return now_ms_; }
  void set_load(bool /*load*/) {}
  void set_led(bool /*on*/) {}
  void save_settings(const uint8_t* /*bytes*/, uint8_t /*size*/) {}
  uint16_t diagnostic(uint8_t /*id*/) const { return 0; }

 private:
  friend class FirmwareRobot;

  std::vector<uint8_t> heard_;
  size_t read_ = 0;
  std::array<uint8_t, client::kMaxClientFrame> sent_{};
  size_t size_ = 0;
  client::Moment now_ms_ = 0;
};

/// A Drive. Its odometry is the pose on the map, so it begins at (0, 0, 0).
class WorldDrive {
 public:
  bool odometry(client::Odometry* odometry) const {
    *odometry = pose_;
    return true;
  }
  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
    wheels_ = client::WheelSpeeds{left_mm_s, right_mm_s};
  }
  void emergency_stop() {}  // zero speeds follow
  const client::DriveStatus& status() const { return status_; }

 private:
  friend class FirmwareRobot;

  client::Odometry pose_{0, 0, 0};
  client::WheelSpeeds wheels_{0, 0};
  client::DriveStatus status_ = client::kNothingToTell;
};

class FirmwareRobot {
 public:
  explicit FirmwareRobot(const client::Parameters& parameters);
  FirmwareRobot(const FirmwareRobot&) = delete;
  FirmwareRobot& operator=(const FirmwareRobot&) = delete;

  void See(const client::Odometry& pose) { drive_.pose_ = pose; }
  void Hear(const protocol::Message& message);
  /// One turn of the firmware's loop. Null: it sends nothing.
  const protocol::Message* Step(client::Moment now_ms);

  client::WheelSpeeds wheels() const { return drive_.wheels_; }
  const client::BehaviourState& state() const { return robot_.conversation().state(); }
  bool greeted() const { return robot_.conversation().requests().greeted; }

 private:
  LinkBoard board_;
  WorldDrive drive_;
  client::RequestMemory memory_{};
  client::Robot<LinkBoard, WorldDrive> robot_;
  protocol::FrameDecoder decoder_;  // the server's, of what it sends
};

}  // namespace pheromone::lab
