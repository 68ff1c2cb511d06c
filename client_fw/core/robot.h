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
//   Moment millis();             a clock (run_down.h)
//   void set_load(bool);         holds or releases the load; called at each Step
//   void set_led(bool);          switches the LED (status_led.h); called at each Step
//   void save_settings(const uint8_t*, uint8_t size);
//                                keeps packed settings (settings.h) for the next start
//   uint16_t diagnostic(uint8_t id);
//                                one of the board's values of diagnostics.h
// Drive:
//   bool odometry(Odometry*);    the pose since power-up; false while it is not known
//   void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s);
//                                clamps to what the drive can do
//   void emergency_stop();       stops as fast as it can; speeds may follow at once
//   const DriveStatus& status();  what else there is to tell
//
// Task: what the robot does besides following pheromones, such as Cleaner. NoTask: nothing.
//   void Step(Moment now_ms, const Odometry* odometry, Conversation*);
//                                after each Poll, with the same odometry; it may Ask
//   WheelSpeeds Wheels(const Conversation&);
//   bool HoldsLoad();            besides COMMANDs
//
// Step() is to be called every millisecond or so: the time of a byte is the time of the Step that
// reads it, and the answer's window opens at the Step that finds the radio idle.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/base/moment.h"
#include "client_fw/core/conversation.h"
#include "client_fw/core/status_led.h"
#include "client_fw/core/steering/range_limit.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace client {

/// Unchanged wheel speeds are repeated this often, zero included: the drive has a watchdog, and a
/// Pioneer resumes its last speed if a command was lost.
constexpr uint16_t kRepeatWheelsMs = 250;

/// It follows pheromones.
struct NoTask {
  void Step(Moment /*now_ms*/, const Odometry* /*odometry*/, Conversation* /*conversation*/) {}
  WheelSpeeds Wheels(const Conversation& conversation) const { return conversation.state().wheels; }
  bool HoldsLoad() const { return false; }
};

template <class Board, class Drive, class Task = NoTask>
class Robot {
 public:
  /// All pointers must outlive the robot.
  Robot(Board* board, Drive* drive, const Parameters& parameters, RequestMemory* memory,
        const Task& task = Task())
      : board_(board), drive_(drive), conversation_(parameters, memory), task_(task) {}

  void Step() {
    const Moment now_ms = board_->millis();
    // First the end of our own frame, then the bytes received after it.
    if (put_ != 0 && put_ == conversation_.tx_size() && board_->radio_tx_idle()) {
      put_ = 0;
      conversation_.OnSent(now_ms);
    }
    for (int byte = board_->radio_get(); byte >= 0; byte = board_->radio_get()) {
      conversation_.OnByte(static_cast<uint8_t>(byte), now_ms);
    }
    const uint8_t wanted = conversation_.state().value_wanted;
    if (wanted != 0) {
      conversation_.behaviour()->Tell(board_->diagnostic(wanted));
    }
    conversation_.behaviour()->OnDrive(drive_->status());
    Odometry odometry = {0, 0, 0};
    const bool known = drive_->odometry(&odometry);
    // Verifying a ROUND takes a while, and then a turn may be due.
    const Moment polled_ms = kHasSigning ? board_->millis() : now_ms;
    conversation_.Poll(polled_ms, known ? &odometry : nullptr, board_->channel_busy());
    task_.Step(now_ms, known ? &odometry : nullptr, &conversation_);
    while (put_ < conversation_.tx_size() && board_->radio_put(conversation_.tx()[put_])) {
      ++put_;
    }
    TellDrive(LimitByRange(task_.Wheels(conversation_), conversation_.state().drive.front_mm),
              static_cast<uint16_t>(now_ms));
    led_.Step(LedCode(conversation_.state().flags, conversation_.state().drive.alarms, known),
              static_cast<uint16_t>(now_ms));
    board_->set_led(led_.on());
    board_->set_load(conversation_.state().load || task_.HoldsLoad());
    if (conversation_.behaviour()->Take(kSaveSettings)) {
      uint8_t bytes[kSettingsSize];
      PackSettings(conversation_.state().stored, bytes);
      board_->save_settings(bytes, sizeof(bytes));
    }
  }

  /// Conversation::GreetAgain.
  void GreetAgain() { conversation_.GreetAgain(); }
  /// Conversation::SetAdapter.
  void SetAdapter(uint8_t adapter_ms, bool rounds) { conversation_.SetAdapter(adapter_ms, rounds); }
  /// COMMAND 2, given by somebody beside the robot.
  protocol::Reason Resume() { return conversation_.behaviour()->Resume(); }

  const Conversation& conversation() const { return conversation_; }
  const Task& task() const { return task_; }
  /// The last speeds given to the drive.
  WheelSpeeds wheels() const { return told_; }

 private:
  void TellDrive(WheelSpeeds wheels, uint16_t now_ms) {
    if (conversation_.behaviour()->Take(kStopAtOnce)) {
      drive_->emergency_stop();
    } else if (driven_ && wheels == told_ &&
               static_cast<uint16_t>(now_ms - told_ms_) < kRepeatWheelsMs) {
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
  Task task_;
  StatusLed led_;
  WheelSpeeds told_ = WheelSpeeds{0, 0};
  uint16_t told_ms_ = 0;
  uint8_t put_ = 0;  // bytes of the frame already given to the board
  bool driven_ = false;
};

}  // namespace client
}  // namespace pheromone
