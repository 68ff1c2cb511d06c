// The messages, as structs, and their one translation to and from Message; those of TAG are in
// tag_messages.h.
//
//   SenseRequest request;
//   if (Decode(message, &request)) ...        // opcode and length are right
//   Encode(SenseAnswer{id, type, wide, left, right}, &message);
//
// Decode checks the opcode and the exact length, and of a ROUND that it is to all and that its
// turns are those of robots; nothing else: whether a value makes sense is for the one who acts on
// it to say. Encode yields a message whose length is right, given a type from 1 to 15 and a command
// code that exists; it does not check them.
//
// Units: coordinates in the map's pose unit (HELLO says how long it is, 1 mm unless configured
// otherwise); headings as binary angles, 65 536 a turn, counter-clockwise from +x; intensities in
// 1/4096 of a pheromone unit.
#pragma once

#include <stdint.h>

#include "protocol/frame.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace protocol {

/// A position on the map and the way the robot faces.
struct WirePose {
  int32_t x = 0;
  int32_t y = 0;
  uint16_t heading = 0;
};

/// Whether x and y fit the narrow messages' 16 bits.
inline bool FitsNarrow(int32_t x, int32_t y) {
  return x >= -32768 && x <= 32767 && y >= -32768 && y <= 32767;
}

/// SENSE and SENSE_WIDE: the paper's "pheromone information request" (Susnea et al. 2009, fig. 9).
struct SenseRequest {
  uint8_t id = 0;
  uint8_t type = 0;
  bool wide = false;
  WirePose pose;
};

/// P_L and P_R of eq. (4) at the two antennas.
struct SenseAnswer {
  uint8_t id = 0;
  uint8_t type = 0;
  bool wide = false;
  int16_t left = 0;
  int16_t right = 0;
};

struct DepositRequest {
  uint8_t id = 0;
  uint8_t type = 0;
  uint8_t seq = 0;
  int16_t x = 0;
  int16_t y = 0;
  uint8_t quanta = 0;
};

struct DepositAnswer {
  uint8_t id = 0;
  uint8_t type = 0;
  uint8_t seq = 0;
};

/// TRACE and TRACE_WIDE: sense here, then leave one quantum.
struct TraceRequest {
  uint8_t id = 0;
  uint8_t type = 0;
  bool wide = false;
  uint8_t seq = 0;
  WirePose pose;
};

struct TraceAnswer {
  uint8_t id = 0;
  uint8_t type = 0;
  bool wide = false;
  uint8_t seq = 0;
  int16_t left = 0;
  int16_t right = 0;
};

/// Server to client. `arguments` are as on the wire; CommandArgumentLength says how many there are.
struct Command {
  uint8_t id = 0;
  uint8_t seq = 0;
  CommandCode code = CommandCode::kHalt;
  uint8_t arguments[kMaxCommandArguments] = {};
};

struct CommandAck {
  uint8_t id = 0;
  uint8_t seq = 0;
  CommandCode code = CommandCode::kHalt;
  int16_t result = 0;  ///< 0 accepted, else a Reason
};

struct EventReport {
  uint8_t id = 0;
  uint8_t seq = 0;
  EventCode code = EventCode::kLoadPicked;
  int16_t argument = 0;
};

struct EventAck {
  uint8_t id = 0;
  uint8_t seq = 0;
};

struct HelloRequest {
  uint8_t id = 0;
  uint16_t nonce = 0;  ///< the client's boot counter
  uint8_t firmware_version = 0;
  uint8_t round_period = 0;  ///< it wants turns this often, in kRoundPeriodMs; 0: none
};

struct HelloAnswer {
  uint8_t id = 0;
  uint16_t nonce = 0;
  uint8_t protocol_version = 0;
  uint16_t epoch = 0;
  uint16_t pose_unit_10um = 0;
  uint16_t antenna_distance_mm = 0;  ///< b of eq. (5)
  uint16_t type_mask = 0;            ///< bit t set: pheromone type t exists
  uint8_t slot_ms = 0;
  uint8_t response_window_ms = 0;
  uint8_t last_opcode = 0;
  uint8_t last_seq = 0;
};

/// Both directions; `answer` tells them apart.
struct Ping {
  uint8_t id = 0;
  bool answer = false;
  uint8_t length = 0;
  uint8_t payload[kMaxPing] = {};
};

struct ErrorAnswer {
  uint8_t id = 0;
  uint8_t refused_opcode = 0;
  Reason reason = Reason::kNone;
  uint8_t seq = 0;  ///< 0 where the refused opcode has none
};

/// An answer in a ROUND. `left` is kNoIntensities where there are none; `right` is then the Reason
/// of an ERROR, or 0: not heard, or not answered yet.
struct RoundAnswer {
  int16_t left = 0;
  int16_t right = 0;
};

/// Server to all: the answers to the robots of the last round, and whose turns follow.
struct Round {
  uint8_t number = 0;      ///< counts the rounds of a link; wraps
  uint8_t turn_ms = 0;     ///< from the beginning of one turn to that of the next
  uint8_t turn_bytes = 0;  ///< the longest frame that fits a turn, as sent
  uint8_t slot_ms = 0;     ///< of contention, for whoever has had no answer to HELLO yet
  uint8_t open_slots = 0;  ///< contention slots after the last turn, or kOpenUntilNextRound
  uint8_t answer_count = 0;
  uint8_t turn_count = 0;
  RoundAnswer answers[kMaxTurns];  ///< in the order of the last round's turns
  uint8_t turns[kMaxTurns] = {};   ///< whose they are
};

bool Decode(const Message& from, SenseRequest* to);
bool Decode(const Message& from, SenseAnswer* to);
bool Decode(const Message& from, DepositRequest* to);
bool Decode(const Message& from, DepositAnswer* to);
bool Decode(const Message& from, TraceRequest* to);
bool Decode(const Message& from, TraceAnswer* to);
bool Decode(const Message& from, Command* to);
bool Decode(const Message& from, CommandAck* to);
bool Decode(const Message& from, EventReport* to);
bool Decode(const Message& from, EventAck* to);
bool Decode(const Message& from, HelloRequest* to);
bool Decode(const Message& from, HelloAnswer* to);
bool Decode(const Message& from, Ping* to);
bool Decode(const Message& from, ErrorAnswer* to);
bool Decode(const Message& from, Round* to);

/// A pose or position outside of the narrow range must be sent wide: Encode of a narrow message
/// with such coordinates returns false and leaves `to` unusable. All others return true.
bool Encode(const SenseRequest& from, Message* to);
bool Encode(const TraceRequest& from, Message* to);
void Encode(const SenseAnswer& from, Message* to);
void Encode(const DepositRequest& from, Message* to);
void Encode(const DepositAnswer& from, Message* to);
void Encode(const TraceAnswer& from, Message* to);
void Encode(const Command& from, Message* to);
void Encode(const CommandAck& from, Message* to);
void Encode(const EventReport& from, Message* to);
void Encode(const EventAck& from, Message* to);
void Encode(const HelloRequest& from, Message* to);
void Encode(const HelloAnswer& from, Message* to);
void Encode(const Ping& from, Message* to);
void Encode(const ErrorAnswer& from, Message* to);
/// At most kMaxTurns answers and turns.
void Encode(const Round& from, Message* to);

}  // namespace protocol
}  // namespace pheromone
