// Counters of a robot's conversation with the server. All wrap.
#pragma once

#include <stdint.h>

#include "client_fw/core/medium/medium_access.h"
#include "client_fw/core/steering/behaviour.h"

namespace pheromone {
namespace client {

struct ConversationCounters {  // plain memory: ConversationCounters() is all zero
  unsigned requests;           ///< SENSE and TRACE sent, retries included
  unsigned answers;            ///< intensities received in answer to one of them
  unsigned stale_answers;      ///< of those, too old for steering: a TRACE retried for long
  unsigned hellos;             ///< HELLO sent
  unsigned hello_answers;      ///< HELLO answered, acceptably or not
  unsigned epochs;             ///< HELLO's answer had another epoch than the one remembered
  unsigned timeouts;           ///< request, HELLO or PING without an answer in its window
  unsigned retries;            ///< requests sent again because of a timeout or a busy server
  unsigned duplicates;         ///< of those, byte-identical repetitions of a TRACE or EVENT
  unsigned abandoned;          ///< periods abandoned after the last retry
  unsigned late_periods;       ///< periods that began late, because of the exchange before
  unsigned stretched_periods;  ///< periods that were lengthened because of congestion
  unsigned lost_traces;        ///< TRACEs and EVENTs abandoned with unknown outcome, or refused
  unsigned late_answers;       ///< addressed to this robot, but not expected
  unsigned resyncs;            ///< PINGs sent to flush a buffered link
  unsigned echoes;             ///< PINGs answered
  unsigned events;             ///< EVENTs acknowledged
  unsigned tag_requests;       ///< requests of TAG sent, retries included
  unsigned tag_answers;        ///< of those, answered without an error
  unsigned errors;             ///< ERROR answers; the last reason is in Conversation
  unsigned commands;           ///< COMMANDs executed
  unsigned refused_commands;   ///< COMMANDs acknowledged with a reason
  unsigned repeated_commands;  ///< COMMANDs acknowledged again without being executed
  unsigned acks;               ///< ACKs sent
  unsigned dropped_acks;       ///< ACKs that could not start within the response window
  unsigned malformed;          ///< COMMANDs of a form we do not know; not acknowledged
  unsigned heard;              ///< frames of or to other robots
  unsigned rounds;             ///< ROUNDs heard
  unsigned turns;              ///< taken in them
  unsigned own_id_heard;       ///< client frames with our ID: an echoing modem, or a double
#if PHEROMONE_SIGNING
  unsigned forged;  ///< a server's frames to us or to all that are not signed, or not so
#endif
};

struct Counters : BehaviourCounters, MediumCounters, ConversationCounters {};

}  // namespace client
}  // namespace pheromone
