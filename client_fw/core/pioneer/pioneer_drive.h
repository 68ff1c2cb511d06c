// A Pioneer at a board's second UART as the Drive of a Robot (robot.h).
//
//   PioneerDrive<Board> drive(&board);
//   Robot<Board, PioneerDrive<Board>> robot(&board, &drive, parameters, &memory);
//   for (;;) { drive.Step(); robot.Step(); ... sleep until the next interrupt ... }
//
// Board, in addition to the requirements of Robot:
//   int robot_get();             the next byte from the Pioneer, or -1
//   bool robot_put(uint8_t);     queues a byte to it; false if there is no room now. With room for
//                                kMaxPioneerCommand bytes, commands leave without gaps.
//   void set_robot_rate(uint8_t);  Pioneer::rate(); called at each Step. A board has a list of bit
//                                rates, and takes the one at this number modulo their number.
//   Moment millis();             the same clock
//
// Step() is to be called every millisecond or so, before each Step of Robot. It reads one SIP at
// most.
#pragma once

#include <stdint.h>

#include "client_fw/core/pioneer/pioneer.h"

namespace pheromone {
namespace client {

template <class Board>
class PioneerDrive {
 public:
  /// `board` must outlive the drive. The other arguments: see Pioneer.
  explicit PioneerDrive(Board* board, int16_t count_100nm = kPioneerCount100Nm,
                        bool with_sonar = false)
      : board_(board), pioneer_(static_cast<uint16_t>(board->millis()), count_100nm, with_sonar) {}

  /// See Pioneer.
  void Continue(const PioneerTrack& track) { pioneer_.Continue(track); }
  void Restart(bool close_first) {
    pioneer_.Restart(static_cast<uint16_t>(board_->millis()), close_first);
  }

  void Step() {
    const uint16_t now_ms = static_cast<uint16_t>(board_->millis());
    // One SIP a step: the robot is to see a bumper that was pressed in only one.
    int byte = board_->robot_get();
    while (byte >= 0 && !pioneer_.OnByte(static_cast<uint8_t>(byte), now_ms)) {
      byte = board_->robot_get();
    }
    pioneer_.Poll(now_ms);
    board_->set_robot_rate(pioneer_.rate());
    while (pioneer_.tx_size() != 0 && board_->robot_put(*pioneer_.tx())) {
      pioneer_.OnPut(now_ms);
    }
  }

  /// The pose since the drive was created; false, and nothing is written, while the link is down.
  bool odometry(Odometry* odometry) const {
    if (!pioneer_.known()) {
      return false;
    }
    *odometry = pioneer_.odometry();
    return true;
  }

  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
    pioneer_.set_wheel_speeds(left_mm_s, right_mm_s);
  }

  void emergency_stop() { pioneer_.emergency_stop(); }
  const DriveStatus& status() const { return pioneer_.status(); }

  const Pioneer& pioneer() const { return pioneer_; }

 private:
  Board* board_;
  Pioneer pioneer_;
};

}  // namespace client
}  // namespace pheromone
