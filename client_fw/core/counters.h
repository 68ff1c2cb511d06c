// What happened in a robot's talk with the server. All wrap.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

struct Counters {              // plain memory: Counters() is all zero
  uint32_t requests;           ///< SENSE and TRACE sent, retries included
  uint32_t answers;            ///< intensities received in answer to one of them
  uint32_t stale_answers;      ///< of those, too old to steer on: a TRACE retried for long
  uint32_t hellos;             ///< HELLO sent
  uint32_t hello_answers;      ///< HELLO answered, acceptably or not
  uint32_t epochs;             ///< HELLO told another epoch than the one remembered
  uint32_t timeouts;           ///< request, HELLO or PING without an answer in its window
  uint32_t retries;            ///< requests sent again because of a timeout or a busy server
  uint32_t duplicates;         ///< of those, byte-identical repetitions of a TRACE
  uint32_t abandoned;          ///< periods given up after the last retry
  uint32_t skipped_periods;    ///< periods that passed while an exchange was still going on
  uint32_t lost_traces;        ///< TRACEs given up with unknown outcome or refused
  uint32_t late_answers;       ///< addressed to this robot, but nobody waited for it
  uint32_t resyncs;            ///< PINGs sent to flush a buffered link
  uint32_t echoes;             ///< PINGs answered
  uint32_t fail_safe_stops;    ///< stopped for want of answers
  uint32_t off_the_map_stops;  ///< stopped because the pose is outside of the map
  uint32_t errors;             ///< ERROR answers; the last reason is in Conversation
  uint32_t commands;           ///< COMMANDs executed
  uint32_t refused_commands;   ///< COMMANDs acknowledged with a reason
  uint32_t repeated_commands;  ///< COMMANDs acknowledged again without being executed
  uint32_t acks;               ///< ACKs sent
  uint32_t dropped_acks;       ///< ACKs that could not start within the response window
  uint32_t malformed;          ///< COMMANDs of a form we do not know; not acknowledged
  uint32_t heard;              ///< frames of or to other robots
  uint32_t own_id_heard;       ///< client frames with our ID: an echoing modem, or a double
};

/// One more. A function of its own because the call is shorter than the addition on an AVR.
void Count(uint32_t* counter);

}  // namespace client
}  // namespace pheromone
