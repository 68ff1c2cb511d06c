// What a robot's modem can tell of its talk with the server: for robots that cannot be asked, such
// as an image without counters.
//
//   RadioTally tally(/*id=*/7);
//   tally.OnSent(byte, time_ns);                 // each byte from the robot to its modem
//   tally.OnHeard(byte, time_ns);                // each byte from the modem to the robot
//   tally.counters().answers; tally.p_left();
//
// Of the counters these are kept: requests, answers, hellos, hello_answers, events, errors, acks,
// heard, rounds. An answer counts whether or not the robot still waited for it. Of signed frames
// (protocol/README.md, section 18) what they say counts: the tally has no key. Times are
// nanoseconds. One thread.
#pragma once

#include <cstdint>

#include "client_fw/core/counters.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::sim {

class RadioTally {
 public:
  explicit RadioTally(uint8_t id, bool is_signed = false) : id_(id), is_signed_(is_signed) {}

  void OnSent(uint8_t byte, int64_t time_ns);
  void OnHeard(uint8_t byte, int64_t time_ns);

  client::Counters counters() const { return counters_; }
  /// Of the last answer, 1/4096 of a unit; 0 before.
  int16_t p_left() const { return p_left_; }
  int16_t p_right() const { return p_right_; }

 private:
  protocol::Message Bare(const protocol::Message& message) const;
  void OnAnswer(int16_t left, int16_t right);
  void OnRound(const protocol::Round& round);

  static constexpr uint16_t kGapTimeoutMs = 20;

  uint8_t id_;
  bool is_signed_;
  protocol::FrameDecoder sent_{kGapTimeoutMs};
  protocol::FrameDecoder heard_{kGapTimeoutMs};
  client::Counters counters_{};
  int turn_ = -1;  // of the last round: the last turn of ours; -1: none
  bool asked_in_turn_ = false;
  int16_t p_left_ = 0;
  int16_t p_right_ = 0;
};

}  // namespace pheromone::sim
