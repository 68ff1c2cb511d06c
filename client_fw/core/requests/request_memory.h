// What must survive a warm reset: the requests, so that each is executed exactly once; the last
// COMMAND, so that a repetition of it is recognised (protocol/README.md, sections 7 and 8); HALT
// and the load, values that are not stored, and where on the map odometry starts; and how many
// HELLOs were signed, whose numbers must not be used again (section 18). A board keeps it in RAM
// that a reset does not clear (.noinit):
//
//   if (!ram_was_kept || !Restore(&memory)) {
//     memory = RequestMemory();
//     parameters.boot_counter = next boot counter;   // a nonce that was never used
//   } else {
//     parameters.boot_counter = memory.nonce;        // the conversation goes on
//   }
//
// Conversation seals it before it sends anything that depends on it, and after it has received
// something; Behaviour after what it changes by itself. After a reset in the middle of a change the
// next boot goes on from the last seal: a request that was not sent is dropped; one whose answer
// was not sealed is sent again byte for byte, and answered as before; a COMMAND has not been
// acknowledged, and comes again. Only a reset between the two instructions with which an AVR writes
// the CRC leaves an empty memory.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/requests/tag_exchange.h"
#include "client_fw/core/signing/signing.h"

namespace pheromone {
namespace client {

/// DATA of the longest request with a seq that is not one of TAG: TRACE_WIDE.
constexpr uint8_t kMaxPending = 11;

struct RequestValues {
  Pose start;          ///< the pose on the map where odometry starts
  uint16_t nonce;      ///< of the boot that used it; another boot counter clears the rest
  uint16_t epoch;      ///< the server's, as last heard
  int16_t speed_mm_s;  ///< if has_speed: by COMMAND 3
  uint8_t type;        ///< by COMMAND 5; 0: as stored
  bool has_speed;
  bool in_use;         ///< false: all of this is to be set
  bool halted;         ///< by a COMMAND or an alarm
  bool load;           ///< it is held
  bool command_known;  ///< ack is of a command that was executed
  uint8_t ack[4];      ///< DATA of the last command's ACK: seq, code, result
  uint8_t seq;     ///< of the last request that had one; before the first, as HELLO's answer said
  uint8_t opcode;  ///< of the request not yet answered, 0: none
  uint8_t length;
  uint8_t data[kMaxPending];  ///< not of TAG
  uint8_t tag_length;
  uint8_t tag_data[kMaxTagRequest];  ///< of a request of TAG with a seq
  bool numbered;                     ///< seq is this boot's own: HELLO has been answered
#if PHEROMONE_SIGNING
  uint16_t hellos_signed;  ///< under this nonce: the number of the next one
#endif
};

/// Plain memory, zeroed by the caller when it cannot be trusted. Only Conversation and Behaviour
/// write to its values. The CRC fits them or what is sealed: at any moment one of the two is whole.
struct RequestMemory : RequestValues {
  uint16_t crc;
  RequestValues sealed;
};

/// To be called after a change.
void Seal(RequestMemory* memory);

/// Whether it is unchanged since Seal.
bool Trusted(const RequestMemory& memory);

/// After a reset: takes the values back to the last Seal, and Seal is to follow. False: there is
/// none.
bool Restore(RequestMemory* memory);

}  // namespace client
}  // namespace pheromone
