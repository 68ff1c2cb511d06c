// The small variables of Conversation, separate so that one loop can clear them as plain memory.
// They come first in the object: an AVR reaches its first 64 bytes with shorter instructions.
//
// Time is kept in timers that run down to 0 and stay there (Conversation::Advance), rather than in
// points of time: a timer cannot wrap, needs no flag for validity, and after a pause of the whole
// loop all of them have expired, which is the right behaviour for a robot.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/medium/census.h"
#include "client_fw/core/requests/request_memory.h"
#include "client_fw/core/requests/tag_exchange.h"
#include "protocol/fields.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace client {

/// The longest frame of a client: TRACE_WIDE, or SYMBOL, with only DLE bytes. Radio buffers have
/// this size.
constexpr uint8_t kMaxClientFrame = 4 + 2 * ((kHasTags ? kMaxTagRequest : kMaxPending) + 4);

class ConversationState {
 protected:
  /// kAwaiting begins with the request's first byte; tx_size_ is not 0 while a frame is being sent.
  enum class Phase : uint8_t { kResting, kContending, kAwaiting };
  enum Timer : uint8_t {
    kPosed,       ///< the pose of the request in progress is fresh
    kContacted,   ///< since the last valid frame of the server for us: HELLO
    kOthers,      ///< another station may be present
    kHeld,        ///< another station's answer or ACK is due
    kAckDue,      ///< our own ACK may still be sent
    kWindow,      ///< kAwaiting: our answer may still begin
    kPeriod,      ///< until the next period begins
    kCensus,      ///< until the other robots have been counted
    kPause,       ///< before HELLO is sent again
    kSlot,        ///< until the next slot begins
    kCarrier,     ///< a carrier may still be a transmission
    kRounds,      ///< the server grants turns
    kReserved,    ///< others have their turns
    kOpen,        ///< rounds: who has no turn may contend
    kTurn,        ///< until our turn begins
    kTurnLate,    ///< until it is too late for it
    kSecondTurn,  ///< until the second one begins
    kTimers
  };

  // Offsets in the DATA of HELLO's answer.
  enum : uint8_t {
    kVersionAt = protocol::OffsetOf(&protocol::HelloAnswer::protocol_version),
    kEpochAt = protocol::OffsetOf(&protocol::HelloAnswer::epoch),
    kPoseUnitAt = protocol::OffsetOf(&protocol::HelloAnswer::pose_unit_10um),
    kTypeMaskAt = protocol::OffsetOf(&protocol::HelloAnswer::type_mask),
    kSlotAt = protocol::OffsetOf(&protocol::HelloAnswer::slot_ms),
    kWindowAt = protocol::OffsetOf(&protocol::HelloAnswer::response_window_ms),
    kLastSeqAt = protocol::OffsetOf(&protocol::HelloAnswer::last_seq),
    kHelloAnswerSize = protocol::SizeOf<protocol::HelloAnswer>().least
  };

  Phase phase_;
  bool greeted_;
  bool resync_;  // buffered link: everything before a PING's echo is discarded
  bool ack_due_;
  bool event_turn_;  // intensities have come in this period, now the events and tags
  bool idle_;        // a slot has begun since the last byte that held the channel
  bool carrier_ignored_;
  uint8_t turns_;          // ours in this round that are still to come
  bool in_turn_;           // kAwaiting: the answer comes with the next ROUND
  bool too_long_;          // the request does not fit a turn: contend for the channel
  bool left_out_;          // the last turn, to contend in the opening after it
  bool in_rounds_;         // turns were granted to us since the last HELLO
  uint8_t round_;          // number of the last ROUND heard
  uint8_t before_us_;      // ID of the robot whose turn precedes ours; 0: the server
  uint8_t before_turns_;   // of it, not heard yet
  uint8_t open_slots_;     // of this round
  uint8_t round_slot_ms_;  // told by the last ROUND; 0: there was none
  uint8_t turn_bytes_;     // the longest frame that fits
  uint8_t turn_index_;     // of our next turn in the round
  uint8_t asked_index_;    // in_turn_: of the turn in which we asked
  uint8_t damaged_;        // frames with a bad CRC, less the valid ones; not below 0
  uint8_t three_bytes_ms_;
  uint8_t attempt_;  // misses since the last success
  uint8_t hello_attempt_;
  uint8_t asked_opcode_;  // kAwaiting: of the request
  uint8_t tx_size_;
  uint8_t tag_bytes_;  // of the frame with this request of TAG; 0: not known
  uint8_t countdown_;  // kContending: the slot that is ours; 0: not drawn, begin at once
  uint16_t quiet_ms_;  // since the last byte heard or sent; stays at the largest value
  // Of this run of bytes, which ends with the idle time:
  uint16_t stray_ms_;          // taken by bytes outside of frames
  uint16_t framed_ms_;         // taken by frames since the last valid one
  uint16_t longest_frame_ms_;  // either holds the channel for this long
  protocol::Reason last_error_;
  BinaryAngle heading_;  // of the last request for intensities
  uint16_t pings_;
  uint32_t now_ms_;
  uint16_t timers_[kTimers];
  Census census_;
  uint8_t server_[kHelloAnswerSize];  // DATA of HELLO's last answer
  uint8_t tx_[kMaxClientFrame];
};

}  // namespace client
}  // namespace pheromone
