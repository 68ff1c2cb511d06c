// One request of TAG and its answer (protocol/README.md, sections 4 and 16): what a program that
// reads and writes tags, such as cleaner.h, gives to the conversation.
//
//   TagExchange exchange;
//   Encode(protocol::TagReadRequest{0, 0, 0, tag, slot}, &exchange.message);
//   conversation.Ask(&exchange);                      // which fills in ID, seq, x and y
//   ... Poll and OnByte as ever, until exchange.state is no longer kAsked ...
//   if (exchange.state == TagExchange::kAnswered && Decode(exchange.message, &answer)) ...
//
// Plain memory; one loop.
#pragma once

#include <stdint.h>

#include "protocol/frame.h"
#include "protocol/opcodes.h"

/// Firmware without tags is built with 0: a client that only follows pheromones fits 16 KiB.
#ifndef PHEROMONE_TAGS
#define PHEROMONE_TAGS 1
#endif

namespace pheromone {
namespace client {

constexpr bool kHasTags = PHEROMONE_TAGS != 0;

/// DATA of the longest request of TAG: SYMBOL with 56 bytes of text.
constexpr uint8_t kMaxTagRequest = kHasTags ? 62 : 1;

struct TagExchange {
  enum State : uint8_t {
    kIdle,
    kAsked,     ///< `message` is the request
    kAnswered,  ///< `message` is the answer, of the right length
    kRefused,   ///< with `reason`; it was not executed, and will not be
    /// Of one that changes something: whether it is executed is unknown. The server's map is
    /// another one now, or it has refused for the moment, though an earlier copy may still arrive.
    kDropped,
  };
  State state = kIdle;
  bool is_pending = false;  ///< the conversation has numbered it, and repeats it byte for byte
  protocol::Reason reason = protocol::Reason::kNone;
  protocol::Message message;
};

}  // namespace client
}  // namespace pheromone
