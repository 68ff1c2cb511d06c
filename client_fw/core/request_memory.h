// What must outlive a warm reset so that each request is executed exactly once (protocol/README.md,
// section 7). A board keeps it where a reset leaves RAM alone (.noinit):
//
//   if (!ram_was_kept || !Trusted(memory)) {
//     memory = RequestMemory();
//     parameters.boot_counter = next boot counter;   // a nonce that was never used
//   } else {
//     parameters.boot_counter = memory.nonce;        // the conversation goes on
//   }
//
// Conversation seals it before anything that follows from it is sent, and after what it heard.
// A reset in the middle of a change therefore leaves it unsealed, and the next boot starts afresh:
// a request that was not sent is forgotten, one that was answered is not sent again.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

/// DATA of the longest request with a seq: TRACE_WIDE.
constexpr uint8_t kMaxPending = 11;

/// Plain memory, zeroed by the caller when it cannot be trusted. Nobody but Conversation writes to
/// it.
struct RequestMemory {
  uint16_t nonce;  ///< of the boot that used it; another boot counter clears the rest
  uint16_t epoch;  ///< the server's, as last heard
  uint8_t seq;     ///< of the last request that had one
  uint8_t opcode;  ///< of the request not yet answered, 0: none
  uint8_t length;
  uint8_t data[kMaxPending];  ///< also where requests without a seq are put together
  uint8_t sent;               ///< how often it was sent and not refused; 2: or more often
  bool remembered;  ///< the server greeted us and must remember a request, or has forgotten us
  uint16_t crc;     ///< of all the above
};

/// To be called after a change.
void Seal(RequestMemory* memory);

/// It is as Seal left it.
bool Trusted(const RequestMemory& memory);

}  // namespace client
}  // namespace pheromone
