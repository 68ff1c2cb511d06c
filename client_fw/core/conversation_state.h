// The small variables of Conversation, apart because as plain memory they are cleared by one loop
// rather than one by one. They come first in the object: an AVR reaches its first 64 bytes with
// shorter instructions.
//
// Points in time are the low half of the clock, which suffices for differences up to half a minute;
// Conversation::Restart deals with longer gaps between two Polls.
#pragma once

#include <stdint.h>

#include "client_fw/core/steering.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace client {

class ConversationState {
 protected:
  enum class Phase : uint8_t { kWaiting, kSending, kAwaiting };
  enum class Job : uint8_t { kHello, kPing, kAsk, kAck };

  Phase phase_;
  Job job_;  // being sent or awaited
  uint8_t flags_;
  bool started_;
  bool greeted_;
  bool drawn_;          // countdown_ms_ has been drawn
  bool was_free_;       // at the last Poll
  bool resync_;         // buffered link: nothing is believed before a PING's echo
  bool others_;         // another station may be about
  bool holding_;        // somebody's answer or ACK is due
  bool pose_known_;     // posed_ means something
  bool command_known_;  // command_seq_ and so on mean something
  bool ack_due_;
  uint8_t attempt_;  // misses since the last success
  uint8_t hello_attempt_;
  uint8_t asked_opcode_;
  uint8_t tx_size_;
  uint16_t now_;
  uint16_t not_before_;    // kWaiting: the countdown starts then
  uint16_t countdown_ms_;  // kWaiting: runs while the channel is free
  uint16_t next_period_;   // begins then
  uint16_t sent_;          // kAwaiting: the window opened then
  uint16_t posed_;         // when the pose of the request in progress was taken
  uint16_t answered_;      // last intensities
  uint16_t contacted_;     // last valid frame of the server for us
  uint16_t heard_;         // last sign of another station
  uint16_t last_byte_;
  uint16_t held_;       // holding_: since then
  uint16_t commanded_;  // ack_due_: since then
  uint32_t last_poll_ms_;
  int16_t p_left_;
  int16_t p_right_;
  WheelSpeeds wheels_;
  uint16_t pings_;
  uint8_t command_seq_;
  uint8_t command_code_;
  protocol::Reason command_result_;
  protocol::Reason last_error_;
};

}  // namespace client
}  // namespace pheromone
