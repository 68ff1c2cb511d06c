// A robot: a radio board, a drive, and the conversation between them. The hardware is a template
// parameter, so that a microcontroller has no cost of indirection.
//
//   Robot<Board, Drive> robot(&board, &drive, parameters, &memory);
//   for (;;) { robot.Step(); ... sleep until the next interrupt ... }
//
// Board:
//   int radio_get();             the next byte received, or -1
//   bool radio_put(uint8_t);     queues a byte to send; false if there is no room now. With
//                                room for kMaxClientFrame bytes, frames are sent without gaps, as
//                                modems require.
//   bool radio_tx_idle();        every byte put has left, its stop bit included
//   bool channel_busy();         carrier detected, or bytes of our own still leaving
//   uint32_t millis();       a clock; may wrap
//   void set_load(bool);         holds or releases the load; called at each Step
//   void save_settings(const uint8_t*, uint8_t size);
//                                keeps the bytes of Settings for the next start
// Drive:
//   bool odometry(Odometry*);    the pose since power-up; false while it is not known
//   void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s);
//                                clamps to what the drive can do
//
// Step() is to be called every millisecond or so: the time of a byte is the time of the Step that
// reads it, and the answer's window opens at the Step that finds the radio idle.
#pragma once

#include <stdint.h>

#include "client_fw/core/angle.h"
#include "client_fw/core/conversation.h"

namespace pheromone {
namespace client {

/// Unchanged wheel speeds are repeated this often, zero included: the drive has a watchdog, and a
/// Pioneer resumes its last speed if a command was lost.
constexpr uint16_t kRepeatWheelsMs = 250;

template <class Board, class Drive>
class Robot {
 public:
  /// All pointers must outlive the robot.
  Robot(Board* board, Drive* drive, const Parameters& parameters, RequestMemory* memory)
      : board_(board), drive_(drive), conversation_(parameters, memory) {}

  void Step() {
    const uint32_t now_ms = board_->millis();
    // First the end of our own frame, then the bytes received after it.
    if (put_ != 0 && put_ == conversation_.tx_size() && board_->radio_tx_idle()) {
      put_ = 0;
      conversation_.OnSent(now_ms);
    }
    for (int byte = board_->radio_get(); byte >= 0; byte = board_->radio_get()) {
      conversation_.OnByte(static_cast<uint8_t>(byte), now_ms);
    }
    Odometry odometry = {0, 0, 0};
    const bool known = drive_->odometry(&odometry);
    conversation_.Poll(now_ms, known ? &odometry : nullptr, board_->channel_busy());
    while (put_ < conversation_.tx_size() && board_->radio_put(conversation_.tx()[put_])) {
      ++put_;
    }
    TellDrive(static_cast<uint16_t>(now_ms));
    board_->set_load(conversation_.load());
    if (conversation_.TakeSettingsChanged()) {
      const Settings& settings = conversation_.parameters();
      board_->save_settings(reinterpret_cast<const uint8_t*>(&settings), sizeof(settings));
    }
  }

  const Conversation& conversation() const { return conversation_; }
  /// The last speeds given to the drive.
  WheelSpeeds wheels() const { return told_; }

 private:
  void TellDrive(uint16_t now_ms) {
    const WheelSpeeds wheels = conversation_.wheels();
    if (driven_ && wheels == told_ && static_cast<uint16_t>(now_ms - told_ms_) < kRepeatWheelsMs) {
      return;
    }
    drive_->set_wheel_speeds(wheels.left_mm_s, wheels.right_mm_s);
    driven_ = true;
    told_ = wheels;
    told_ms_ = now_ms;
  }

  Board* board_;
  Drive* drive_;
  Conversation conversation_;
  WheelSpeeds told_ = WheelSpeeds{0, 0};
  uint16_t told_ms_ = 0;
  uint8_t put_ = 0;  // bytes of the frame already given to the board
  bool driven_ = false;
};

}  // namespace client
}  // namespace pheromone
