// Counters of a robot's conversation with the server. All wrap.
#pragma once

#include <stdint.h>

#include "client_fw/core/medium/medium_access.h"
#include "client_fw/core/steering/behaviour.h"

namespace pheromone {
namespace client {

struct Counters : BehaviourCounters, MediumCounters {  // plain memory: Counters() is all zero
  uint32_t requests;                                   ///< SENSE and TRACE sent, retries included
  uint32_t answers;            ///< intensities received in answer to one of them
  uint32_t stale_answers;      ///< of those, too old for steering: a TRACE retried for long
  uint32_t hellos;             ///< HELLO sent
  uint32_t hello_answers;      ///< HELLO answered, acceptably or not
  uint32_t epochs;             ///< HELLO's answer had another epoch than the one remembered
  uint32_t timeouts;           ///< request, HELLO or PING without an answer in its window
  uint32_t retries;            ///< requests sent again because of a timeout or a busy server
  uint32_t duplicates;         ///< of those, byte-identical repetitions of a TRACE or EVENT
  uint32_t abandoned;          ///< periods abandoned after the last retry
  uint32_t late_periods;       ///< periods that began late, because of the exchange before
  uint32_t stretched_periods;  ///< periods that were lengthened because of congestion
  uint32_t lost_traces;        ///< TRACEs and EVENTs abandoned with unknown outcome, or refused
  uint32_t late_answers;       ///< addressed to this robot, but not expected
  uint32_t resyncs;            ///< PINGs sent to flush a buffered link
  uint32_t echoes;             ///< PINGs answered
  uint32_t events;             ///< EVENTs acknowledged
  uint32_t tag_requests;       ///< requests of TAG sent, retries included
  uint32_t tag_answers;        ///< of those, answered without an error
  uint32_t errors;             ///< ERROR answers; the last reason is in Conversation
  uint32_t commands;           ///< COMMANDs executed
  uint32_t refused_commands;   ///< COMMANDs acknowledged with a reason
  uint32_t repeated_commands;  ///< COMMANDs acknowledged again without being executed
  uint32_t acks;               ///< ACKs sent
  uint32_t dropped_acks;       ///< ACKs that could not start within the response window
  uint32_t malformed;          ///< COMMANDs of a form we do not know; not acknowledged
  uint32_t heard;              ///< frames of or to other robots
  uint32_t rounds;             ///< ROUNDs heard
  uint32_t turns;              ///< taken in them
  uint32_t skipped_turns;      ///< not taken: the channel was not free
  uint32_t own_id_heard;       ///< client frames with our ID: an echoing modem, or a double
};

}  // namespace client
}  // namespace pheromone
