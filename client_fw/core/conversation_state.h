// The small variables of Conversation, separate so that one loop can clear them as plain memory.
// They come first in the object: an AVR reaches its first 64 bytes with shorter instructions.
//
// Time is kept in timers that run down to 0 and stay there (Conversation::Advance), rather than in
// points of time: a timer cannot wrap, needs no flag for validity, and after a pause of the whole
// loop all of them have expired, which is the right behaviour for a robot.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/base/moment.h"
#include "client_fw/core/requests/request_memory.h"
#include "client_fw/core/requests/tag_exchange.h"
#include "client_fw/core/signing/link_signing.h"
#include "protocol/fields.h"
#include "protocol/frame.h"
#include "protocol/opcodes.h"
#include "protocol/signing.h"

namespace pheromone {
namespace client {

/// DATA of a client has room for so many bytes, without what signing adds.
constexpr uint8_t kMaxSignedData = protocol::kMaxData - protocol::kSignature;

/// The longest frame of a client: TRACE_WIDE, or SYMBOL, with only DLE bytes. Radio buffers have
/// this size.
constexpr uint8_t kMaxClientFrame =
    4 + 2 * ((!kHasTags     ? kMaxPending + (kHasSigning ? protocol::kSignature : 0)
              : kHasSigning ? protocol::kMaxData
                            : kMaxTagRequest) +
             4);

struct RequestState {           // plain memory: all zero
  bool greeted;                 ///< HELLO has been answered by a compatible server
  bool event_turn;              ///< intensities have come in this period, now the events and tags
  protocol::Reason last_error;  ///< the reason of the last ERROR; kNone before
};

class ConversationState {
 protected:
  /// kAwaiting begins with the request's first byte; tx_size_ is not 0 while a frame is being sent.
  enum class Phase : uint8_t { kResting, kContending, kAwaiting };
  enum Timer : uint8_t {
    kPosed,      ///< the pose of the request in progress is fresh
    kContacted,  ///< since the last valid frame of the server, or turn: HELLO once we give up
    kAckDue,     ///< our own ACK may still be sent
    kWindow,     ///< kAwaiting: our answer may still begin
    kPeriod,     ///< until the next period begins
    kPause,      ///< before HELLO is sent again
    kSpokenTo,   ///< with signing: since the server's last frame to us, or turn, that it has signed
    kTimers = kSpokenTo + (kHasSigning ? 1 : 0)
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

  /// While a change waits, the robot drives on by queries: some before each repetition, and one
  /// more when it has been settled. Each counts down to kNoQueryYet. A busy server adds kQueryDue,
  /// so that from kNoQuery, kNoQueryYet and kQueryMade one, two and three are due.
  enum Query : uint8_t {
    kNoQuery,     ///< none since the change was made
    kNoQueryYet,  ///< nor here, but while the change before waited: the server's log is slow
    kQueryMade,   ///< the change's own intensities are old from now on
    kQueryDue,    ///< the server has been silent twice, or on a buffered link once
  };

  Phase phase_;
  uint8_t query_;  // see Query
  RequestState requests_;
  bool resync_;  // buffered link: everything before a PING's echo is discarded
  bool ack_due_;
  bool in_turn_;         // kAwaiting: the answer comes with the next ROUND
  bool too_long_;        // the request does not fit a turn: contend for the channel
  bool left_out_;        // the last turn, to contend in the opening after it
  bool in_rounds_;       // turns were granted to us since the last HELLO
  uint8_t asked_index_;  // in_turn_: of the turn in which we asked
  uint8_t attempt_;      // misses since the last success
  uint8_t hello_attempt_;
  uint8_t asked_opcode_;  // kAwaiting: of the request
  uint8_t tx_size_;
  uint8_t tag_bytes_;    // of the frame with this request of TAG; 0: not known
  BinaryAngle heading_;  // of the last request for intensities
  uint16_t pings_;
  Moment now_ms_;
  uint16_t timers_[kTimers];
  uint8_t fresh_length_;
  uint8_t fresh_[kMaxPending];        // DATA of a request in the making; of one without a seq
  uint8_t server_[kHelloAnswerSize];  // DATA of HELLO's last answer
  uint8_t tx_[kMaxClientFrame];
};

}  // namespace client
}  // namespace pheromone
